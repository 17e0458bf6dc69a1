"""The library of effects: laws of missing physics, and everything that is known of each."""
