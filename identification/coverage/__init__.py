"""Whether 95 % intervals hold the truth in 95 % of simulated experiments."""
