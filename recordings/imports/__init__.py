"""Readers of other formats: each gives the columns of one file as a table."""
