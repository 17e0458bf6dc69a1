"""The arm and the question: robot, observation matrix, base parameters, trajectories, limits, fitness."""
