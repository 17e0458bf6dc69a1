"""Studies made with the harness: the paper, where it stops, best trajectories, regression guard, speed and scale."""
