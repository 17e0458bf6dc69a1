"""The diagnosis of recordings with torque: rows, columns, search, evidence, names, prediction."""
