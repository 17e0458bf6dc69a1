"""Effects that are hidden in recordings: each a law, a body, a part of the drive, or a fault of a channel."""
