"""The landscapes of the suites: features of each problem, which of them make an algorithm win, and which to take."""
