"""Results as data that travel: collected from the run store, as tidy tables, in the format of IOHprofiler."""
