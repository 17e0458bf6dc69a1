"""What each algorithm does to a problem that is only moved, scaled or noise, and what it costs."""
