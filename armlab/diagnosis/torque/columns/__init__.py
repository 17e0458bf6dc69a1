"""The columns of links and effects on these rows, and fits from their moments."""
