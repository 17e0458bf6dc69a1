"""The truth machine: recordings with hidden effects from an independent engine, sealed answers, scores."""
