"""From recordings to parameters: model structure, estimators, intervals, validation, export."""
