"""Does a small condition number help on real arms? Windows of public recordings, and how well they predict torque."""
