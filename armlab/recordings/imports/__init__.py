"""Readers of other formats: each returns the columns of one file as a table."""
