"""Probabilities of names, learnt from judged sets."""
