"""The next experiment: the motion on which rival explanations of a recording differ most."""
