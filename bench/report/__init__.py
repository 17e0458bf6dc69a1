"""One self-contained HTML page about a result set."""
