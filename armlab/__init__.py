"""Excitation trajectories, identification and diagnosis of robot arms."""
