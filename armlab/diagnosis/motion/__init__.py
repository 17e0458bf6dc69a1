"""Diagnosis of recordings of motion only: which numbers of a position servo differ from the simulation's."""
