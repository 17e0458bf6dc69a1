"""Real recordings with a known effect concealed: withheld from the simulation, or added to the torque."""
