"""The regression check: a short fixed sweep against a committed baseline, by rank statistics and never by time."""
