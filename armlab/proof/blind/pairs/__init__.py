"""Pairs of recordings of one robot, with nothing changed or one thing: the proof of a comparison."""
