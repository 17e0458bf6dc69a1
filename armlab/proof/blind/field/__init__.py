"""Recordings that resemble real ones: every law at once, and a rest that no law explains."""
