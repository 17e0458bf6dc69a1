"""The card of a planned motion as a page."""
