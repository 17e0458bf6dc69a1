"""Does a small condition number help? Identification errors against the criteria that trajectories are chosen by."""
