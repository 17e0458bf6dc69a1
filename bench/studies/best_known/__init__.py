"""The best trajectory known for each problem, found with exact derivatives from many starts."""
