"""Recordings of real arms: format, importers, checks and repairs, filters."""
