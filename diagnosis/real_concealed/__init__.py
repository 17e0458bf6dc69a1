"""Real recordings with something concealed on purpose: withheld from the simulation, or added to the torque."""
