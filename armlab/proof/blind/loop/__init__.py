"""The closed loop: an ambiguous recording, a second motion, and whether both together name what is hidden."""
