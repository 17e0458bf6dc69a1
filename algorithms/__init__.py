"""Metaheuristics, one a file, behind one ask/tell interface."""
