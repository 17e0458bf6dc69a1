"""The public recordings identified by one procedure, and judged on data that took no part."""
