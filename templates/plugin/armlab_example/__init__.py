"""An algorithm and a problem for armlab."""
