"""How alike simulated and real recordings are: features, a classifier, a page, and pictures for a reader."""
