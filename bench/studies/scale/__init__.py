"""The cost of a large sweep, and what is lost when it is killed, measured on the real command."""
