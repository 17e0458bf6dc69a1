"""The feasible search space: what it does for each algorithm, and what it gives up of the best known."""
