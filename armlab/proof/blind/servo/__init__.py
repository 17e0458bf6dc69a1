"""The proof of recordings of motion only: arms with servos and joints that stick, on an engine of their own."""
