"""Configuration, runner, run store, statistics, tables, figures and the command line."""
