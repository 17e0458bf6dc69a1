"""The speed of armlab beside other packages, measured in the same run."""
