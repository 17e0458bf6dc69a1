"""The page of `armlab recording check`: findings as a table, signals as pictures, one file."""
