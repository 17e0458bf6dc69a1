"""Proof of the diagnosis: what is judged blindly, what is judged on open data, and the tiers of both."""
