"""The engine of the diagnosis: linear algebra on filtered, whitened columns, and the search over them."""
