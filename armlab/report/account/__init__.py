"""What is said of a finished diagnosis: one rule for the summary, the page, the terminal and the files."""
