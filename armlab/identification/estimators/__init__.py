"""Estimators: from a regression to parameters, each with what its intervals need."""
