"""The commands of `armlab`, without any logic of their own."""
