"""Public recordings of real arms: where they are, and how their raw files become recording folders."""
