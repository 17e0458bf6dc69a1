"""The proof of how recordings are read: mistakes that are put into recording folders, and what is said of them."""
