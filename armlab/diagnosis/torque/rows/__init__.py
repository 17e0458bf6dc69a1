"""From a recording to filtered rows, their noise and their features."""
