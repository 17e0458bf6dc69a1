"""Looks for what is wrong with a recording and cannot be repaired: it is said, and left as it is."""
