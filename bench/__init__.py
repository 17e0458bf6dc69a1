"""The benchmark harness: configuration, plan, execution, run store, statistics, tables, figures and studies."""
