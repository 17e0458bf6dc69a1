"""Studies made with the harness: the paper and beyond, best known trajectories, regression check, speed and scale."""
