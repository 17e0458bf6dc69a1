"""Results as data that travel: collected from the run store, compared, as tidy tables, in the format of IOHprofiler."""
