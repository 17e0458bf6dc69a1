"""Names of findings with probabilities: what is weighed, how likely each name is, and what is claimed."""
