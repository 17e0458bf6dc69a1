"""Two result sets beside each other."""
