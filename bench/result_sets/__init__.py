"""Results as data: read from the run store, compared, and written as tidy tables or in IOHprofiler's format."""
