"""The public recordings identified by one procedure: recipes, the choice inside the identification data, looks."""
