"""Counts what verdicts got right; the only part that reads the truth."""
