"""What a large sweep costs, and what is left of it when it is killed: measured on the real command."""
