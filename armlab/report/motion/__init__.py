"""What is said of recordings of motion only."""
