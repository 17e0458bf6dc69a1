"""Statistics of the ends and curves of many runs; each is checked against a published or independent example."""

from bench.statistics.ends import Summary, is_feasible, quantile, summarise

__all__ = ["Summary", "is_feasible", "quantile", "summarise"]
