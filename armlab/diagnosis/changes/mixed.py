"""Least squares in which the slow drift of each run is random.

    torque = columns @ values + drift + noise

at each joint. The drift is a slow change of offset and of friction within each run and between runs, its size found by
restricted likelihood (Patterson and Thompson 1971), and a torque constant that differs between runs by a known share. A
level that wanders within a run wanders between runs, too, and is no evidence of a change.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve
from scipy.sparse import csr_array

from armlab.common.arrays import Array

VARIANCE_RATIOS = 10.0 ** np.arange(-6.0, 6.1, 0.5)  # of a random part over the noise, that are tried
FIRST_RATIO = 1e-4
LIKELIHOOD_ROUNDS = 3
LEAST_NOISE = 1e-5  # of a joint's torque: finer than any sensor, where a drive reports no torque
INDEPENDENT_POWER = 1e-9  # of the largest eigenvalue of scaled columns: less is rounding
LEAST_PRECISION = 1e-10  # of a column's information: keeps what no row determines finite


@dataclass(frozen=True, eq=False)
class JointRows:
    """The rows of one joint that count.

    columns: (rows, own), index: (own,) their numbers among all. target: (rows,). random: parts (rows, count), one
    variance a part. waves: (count of all,), False for constants of a run. known: (rows, count), random columns of known
    size. stretches, runs, members: (rows,), stretch of time, run and recording of each row. weights: (rows,), of the
    squares; columns and target are times their roots.
    """

    columns: Array
    index: NDArray[np.intp]
    target: Array
    random: tuple[Array, ...]
    waves: NDArray[np.bool_]
    known: Array
    stretches: NDArray[np.intp]
    runs: NDArray[np.intp]
    members: NDArray[np.intp]
    weights: Array


@dataclass(frozen=True, eq=False)
class WeightedRows:
    """Rows of one joint with the covariance of drift and noise. variance: of the noise.

    drift: (rows, count), random columns in units of the noise, those of known size last. axes: (rows, count),
    orthonormal, of the drift. kept: (count,), the share that whitening keeps along each. white: whitened columns, and
    the target last.
    """

    rows: JointRows
    variance: float
    drift: Array
    axes: Array
    kept: Array
    white: Array

    def whiten(self, values: Array) -> Array:
        """The symmetric root of the inverse covariance times values (rows, ...)."""
        return _whiten(values, self.axes, self.kept, self.variance)

    @cached_property
    def weighted(self) -> Array:
        """The inverse covariance times the columns, (rows, own)."""
        return self.whiten(self.white[:, :-1])

    @cached_property
    def along_drift(self) -> Array:
        """Products of the random columns with the weighted ones, (count, own)."""
        return np.asarray(self.drift.T @ self.weighted)

    def stretch_sums(self, stretches: int) -> csr_array:
        """The matrix (stretches, rows) that adds up the rows of each stretch."""
        rows = np.arange(len(self.rows.stretches))
        return csr_array((np.ones(len(rows)), (self.rows.stretches, rows)), shape=(stretches, len(rows)))


def weigh_rows(rows: JointRows) -> WeightedRows:
    """The rows with the likeliest covariance of drift and noise."""
    variance, ratios = _restricted_variances(rows)
    sizes = [part.shape[1] for part in rows.random]
    drift = np.column_stack([*rows.random, rows.known])
    drift = drift * np.sqrt([*np.repeat(ratios, sizes), *np.full(rows.known.shape[1], 1 / variance)])
    axes, sizes_along, _ = np.linalg.svd(drift, full_matrices=False)
    kept = 1 / np.sqrt(1 + sizes_along**2)
    white = _whiten(np.column_stack([rows.columns, rows.target]), axes, kept, variance)
    return WeightedRows(rows, variance, drift, axes, kept, white)


def _whiten(values: Array, axes: Array, kept: Array, variance: float) -> Array:
    """Values times (1 + drift drift')^(-1/2), over the deviation of the noise: products of them are never negative."""
    along = (axes.T @ values).T * (1 - kept)
    return np.asarray((values - axes @ along.T) / np.sqrt(variance))


def _restricted_variances(rows: JointRows) -> tuple[float, tuple[float, ...]]:
    """Variance of the noise, and of each random part over it, where the restricted likelihood is largest."""
    basis = _orthonormal_basis(rows.columns)
    left = rows.target - basis @ (basis.T @ rows.target)
    random = np.column_stack([*rows.random, rows.known])
    random = random - basis @ (basis.T @ random)
    gram, towards, power = random.T @ random, random.T @ left, float(left @ left)
    free = max(float(rows.weights.sum()) - basis.shape[1], 1.0)
    least = free * max(LEAST_NOISE**2 * float(np.mean(rows.target**2)), 1e-300)
    sizes = [part.shape[1] for part in (*rows.random, rows.known)]

    def rest_and_spread(ratios: Sequence[float]) -> tuple[float, float]:
        root = np.sqrt(np.repeat(ratios, sizes))
        scaled_gram = root[:, None] * gram * root
        rounding = np.finfo(float).eps * float(np.trace(scaled_gram))
        factor = cho_factor((1 + rounding) * np.eye(len(gram)) + scaled_gram, lower=True)
        scaled = root * towards
        rest = power - float(scaled @ cho_solve(factor, scaled))
        return max(rest, least), 2 * float(np.sum(np.log(np.diag(factor[0]))))

    def likelihood(ratios: Sequence[float]) -> float:
        rest, spread = rest_and_spread(ratios)
        return float(-0.5 * (free * np.log(rest) + spread))

    ratios = [*[FIRST_RATIO] * len(rows.random), free / max(power, 1e-300)]
    for _ in range(LIKELIHOOD_ROUNDS):
        for part in range(len(rows.random)):
            tried = [likelihood([*ratios[:part], ratio, *ratios[part + 1 :]]) for ratio in VARIANCE_RATIOS]
            ratios[part] = float(VARIANCE_RATIOS[int(np.argmax(tried))])
        variance = rest_and_spread(ratios)[0] / free
        ratios[-1] = 1 / variance
    return variance, tuple(ratios[:-1])


def _orthonormal_basis(columns: Array) -> Array:
    """An orthonormal basis of columns, dependent ones left out."""
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns[:, lengths > 0] / lengths[lengths > 0]
    power, axes = np.linalg.eigh(scaled.T @ scaled)
    kept = power > INDEPENDENT_POWER * power.max(initial=0.0)
    return np.asarray(scaled @ (axes[:, kept] / np.sqrt(power[kept])))


@dataclass(frozen=True, eq=False)
class MixedModel:
    """All joints. size: number of columns. prior: (size,), precision of the prior of each, zero where there is none."""

    joints: tuple[WeightedRows, ...]
    size: int
    prior: Array

    @cached_property
    def information(self) -> Array:
        """(size + 1, size + 1), weighted products of all columns and the target, which is last."""
        out = np.zeros((self.size + 1, self.size + 1))
        for each in self.joints:
            place = np.append(each.rows.index, self.size)
            out[np.ix_(place, place)] += each.white.T @ each.white
        return out

    @cached_property
    def precision(self) -> Array:
        """(size,), of the priors, and a little for what no row determines."""
        return np.maximum(self.prior, LEAST_PRECISION * np.maximum(np.diag(self.information)[:-1], 1e-300))

    def fit(self, chosen: NDArray[np.intp]) -> tuple[Array, Array]:
        """Values and covariance of chosen columns, the others left out."""
        matrix = self.information[np.ix_(chosen, chosen)] + np.diag(self.precision[chosen])
        scale = 1 / np.sqrt(np.diag(matrix))
        inverse = np.linalg.inv(matrix * np.outer(scale, scale)) * np.outer(scale, scale)
        return inverse @ self.information[chosen, -1], inverse

    @cached_property
    def stretches(self) -> int:
        """Number of stretches of time."""
        return 1 + max(int(each.rows.stretches.max()) for each in self.joints)

    def errors(self, joint: int, chosen: NDArray[np.intp], values: Array) -> Array:
        """What values of chosen columns leave at a joint, (rows,)."""
        full = np.zeros(self.size)
        full[chosen] = values
        rows = self.joints[joint].rows
        return np.asarray(rows.target - rows.columns @ full[rows.index])

    def scatter(self, chosen: NDArray[np.intp], values: Array) -> tuple[Array, Array]:
        """What the stretches of time say of the variance of the weighted errors' products with chosen columns.

        Sum over stretches of the squared products, whose errors may be of any kind within a stretch (Liang and Zeger
        1986), and the share of the drift, which ties stretches: (chosen, chosen). The second is the part of it by which
        runs differ as a whole.
        """
        where = np.full(self.size, -1)
        where[chosen] = np.arange(len(chosen))
        products = np.zeros((self.stretches, len(chosen)))
        drift, between = np.zeros((2, len(chosen), len(chosen)))
        for joint, each in enumerate(self.joints):
            used = np.flatnonzero(where[each.rows.index] >= 0)
            place = where[each.rows.index[used]]
            noise = each.variance * each.whiten(each.whiten(self.errors(joint, chosen, values)))
            products[:, place] += each.stretch_sums(self.stretches) @ (each.weighted[:, used] * noise[:, None])
            along = each.along_drift[:, used]
            constant = along[: len(each.rows.waves)][~each.rows.waves]
            drift[np.ix_(place, place)] += each.variance * along.T @ along
            between[np.ix_(place, place)] += each.variance * constant.T @ constant
        count = int(np.sum(np.any(products != 0, axis=1)))
        return np.asarray(products.T @ products * count / max(count - 1, 1) + drift), between

    def held_out_errors(self, chosen: NDArray[np.intp]) -> list[Array]:
        """Errors (rows,) of each joint where chosen columns and drift were fitted to all other stretches.

        A constant of each run is no part of the drift here: it would stand for a change.
        """
        designs, places, at = [], [], len(chosen)
        waves = [each.drift[:, : len(each.rows.waves)][:, each.rows.waves] for each in self.joints]
        where = np.full(self.size, -1)
        where[chosen] = np.arange(len(chosen))
        for each, drift in zip(self.joints, waves, strict=True):
            used = np.flatnonzero(where[each.rows.index] >= 0)
            designs.append(np.column_stack([each.rows.columns[:, used], drift]))
            places.append(np.append(where[each.rows.index[used]], at + np.arange(drift.shape[1])))
            at += drift.shape[1]
        precisions = [np.full(int(each.rows.waves.sum()), 1 / each.variance) for each in self.joints]
        whole = np.zeros((at, at + 1))
        whole[:, :at] = np.diag(np.concatenate([self.precision[chosen], *precisions]))
        products: list[dict[int, tuple[NDArray[np.intp], Array]]] = [{} for _ in range(self.stretches)]
        for joint, each in enumerate(self.joints):
            place, both = places[joint], np.column_stack([designs[joint], each.rows.target])
            order = np.argsort(each.rows.stretches, kind="stable")
            for rows in np.split(order, np.flatnonzero(np.diff(each.rows.stretches[order])) + 1):
                own = designs[joint][rows].T @ both[rows] / each.variance
                whole[np.ix_(place, np.append(place, at))] += own
                products[int(each.rows.stretches[rows[0]])][joint] = rows, own
        out = [np.empty(len(each.rows.target)) for each in self.joints]
        for stretch in products:
            others = whole.copy()
            for joint, (_, own) in stretch.items():
                others[np.ix_(places[joint], np.append(places[joint], at))] -= own
            scale = 1 / np.sqrt(np.diag(others[:, :at]))
            scaled = others[:, :at] * np.outer(scale, scale) + INDEPENDENT_POWER * np.eye(at)
            values = scale * cho_solve(cho_factor(scaled, overwrite_a=True), scale * others[:, at])
            for joint, (rows, _) in stretch.items():
                out[joint][rows] = self.joints[joint].rows.target[rows] - designs[joint][rows] @ values[places[joint]]
        return out
