"""Least squares under conditions of convex cones, solved by Clarabel (Goulart and Chen 2024).

min |F x - g|^2 + c' x  with  A x + a = 0,  B x + b >= 0,  symmetric matrices linear in x positive semidefinite, and
numbers below the log-determinants of such matrices (Boyd and Vandenberghe 2004).
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from armlab.common.arrays import Array
from armlab.common.packages import import_package


@dataclass(eq=False)
class ConicProgram:
    """Conditions on the first `size` unknowns and on those that conditions add; then `solve`."""

    size: int
    _rows: list[tuple[Array, Array, str, int]] = field(default_factory=list)
    _unknowns: int = field(init=False)

    def __post_init__(self) -> None:
        self._unknowns = self.size

    def require_nonnegative(self, rows: Array) -> None:
        """rows @ x >= 0, rows (conditions, unknowns)."""
        self._add(rows, np.zeros(len(rows)), "NonnegativeConeT", len(rows))

    def require_semidefinite(self, matrices: Array, offset: Array) -> None:
        """offset + sum of x[k] * matrices[k] positive semidefinite; (unknowns, n, n) and (n, n), symmetric."""
        self._add(_triangles(matrices).T, _triangles(offset[None])[0], "PSDTriangleConeT", len(offset))

    def log_determinant(self, matrices: Array) -> Array:
        """Row r (unknowns,) with r @ x at most the log-determinant of sum of x[k] * matrices[k], (unknowns, n, n).

        A lower triangle Z with [[X, Z], [Z', diag(Z)]] positive semidefinite has log det X >= sum of log Z[i, i].
        """
        order = matrices.shape[1]
        lower = np.argwhere(np.tri(order, dtype=bool))
        triangle = self._new_unknowns(len(lower))
        logarithms = self._new_unknowns(order)
        joined = np.zeros((self._unknowns, 2 * order, 2 * order))
        joined[: len(matrices), :order, :order] = matrices
        diagonal = np.zeros(order, int)
        for place, (row, column) in zip(triangle, lower, strict=True):
            joined[place, row, order + column] = joined[place, order + column, row] = 1.0
            if row == column:
                joined[place, order + row, order + row] = 1.0
                diagonal[row] = place
        self.require_semidefinite(joined, np.zeros((2 * order, 2 * order)))
        for logarithm, entry in zip(logarithms, diagonal, strict=True):  # exp(logarithm) <= entry
            rows = np.zeros((3, self._unknowns))
            rows[0, logarithm] = rows[2, entry] = 1.0
            self._add(rows, np.array([0.0, 1.0, 0.0]), "ExponentialConeT", 0)
        total = np.zeros(self._unknowns)
        total[logarithms] = 1.0
        return total

    def solve(self, factor: Array, target: Array, linear: Array | float = 0.0) -> Array | str:
        """The first `size` unknowns where |factor @ x - target|^2 + linear @ x is least, or what the solver says."""
        clarabel: Any = import_package("clarabel", "bodies that can exist")
        left_over = self._new_unknowns(len(target))
        equal = self._padded(factor)
        equal[np.arange(len(target)), left_over] = -1.0
        self._rows.insert(0, (equal, -target, "ZeroConeT", len(target)))
        squares = np.zeros(self._unknowns)
        squares[left_over] = 2.0
        costs = self._padded(np.broadcast_to(linear, np.shape(linear) or self.size)[None])[0]
        conditions = -np.vstack([self._padded(rows) for rows, *_ in self._rows])
        offsets = np.concatenate([offset for _, offset, *_ in self._rows])
        cones = [getattr(clarabel, kind)(*([count] if count else [])) for *_, kind, count in self._rows]
        settings = clarabel.DefaultSettings()
        settings.verbose = False
        # With the usual 1e-8, 2 of 100 fits of two real arms break down and 19 end early; with this all are solved.
        settings.static_regularization_constant = 1e-7
        weights = csc_matrix(np.diag(squares))
        solver = clarabel.DefaultSolver(weights, costs, csc_matrix(conditions), offsets, cones, settings)
        solution = solver.solve()
        if solution.status not in (clarabel.SolverStatus.Solved, clarabel.SolverStatus.AlmostSolved):
            return str(solution.status)
        return np.asarray(solution.x)[: self.size]

    def _add(self, rows: Array, offset: Array, kind: str, count: int) -> None:
        self._rows.append((rows, np.asarray(offset, float), kind, count))

    def _new_unknowns(self, count: int) -> NDArray[np.intp]:
        self._unknowns += count
        return np.arange(self._unknowns - count, self._unknowns)

    def _padded(self, rows: Array) -> Array:
        """Rows with zeros for the unknowns that came later."""
        return np.pad(rows, ((0, 0), (0, self._unknowns - rows.shape[1])))


def _triangles(matrices: Array) -> Array:
    """Upper triangles column by column, off the diagonal times sqrt(2): (count, n, n) to (count, n (n + 1) / 2)."""
    order = matrices.shape[1]
    columns, rows = np.tril_indices(order)
    return np.asarray(matrices[:, rows, columns] * np.where(rows == columns, 1.0, np.sqrt(2)))
