"""Public recordings of motion only, and the same fits by another package."""
