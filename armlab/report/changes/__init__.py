"""What is said of recordings that are compared."""
