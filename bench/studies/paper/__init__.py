"""Replication of the paper: its tables and figures, and a report on which of its claims hold."""
