"""What speaks for each effect that was found, and which of them hold."""
