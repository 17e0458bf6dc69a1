"""The command line: one file a group of commands, with options and no logic."""
