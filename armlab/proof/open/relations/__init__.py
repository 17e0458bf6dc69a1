"""Relations that hold for every recording, whatever is true of the robot: checks that need no answers."""
