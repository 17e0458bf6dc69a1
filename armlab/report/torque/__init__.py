"""The report of a diagnosis: a page to forward, its figures as files, and a short text for the terminal."""
