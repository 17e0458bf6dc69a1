"""How fast armlab is, beside other packages in the same run."""
