"""What all parts share: errors, settings, files, text. It imports nothing else of the project."""
