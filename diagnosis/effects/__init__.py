"""The library of effects, one family a file."""
