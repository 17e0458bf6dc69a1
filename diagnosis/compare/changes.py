"""Parameters of both recordings under one structure, and which of them differ by more than chance."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from armlab.diagnosis.intervals import parameter_half_widths
from armlab.diagnosis.result import Diagnosis
from armlab.effects.contract import Candidate
from diagnosis.compare.structure import Fit, fitted, separable, united
from problem.arm import PARAMETER_UNITS
from problem.base_parameters import BaseParameters, base_parameters
from recordings.run import Array

LEVEL = 0.01


@dataclass(frozen=True)
class Change:
    """One parameter in both recordings. effect: `base_parameter` for one of the rigid body, named by its sum.

    interval: 95 %, of the difference. p_value: of no difference, after Holm's correction over all parameters.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    parameter: str
    old: float
    new: float
    interval: tuple[float, float]
    unit: str
    p_value: float

    @property
    def changed(self) -> bool:
        """Whether the difference is more than chance."""
        return self.p_value < LEVEL


def changes_between(old: Diagnosis, new: Diagnosis) -> tuple[Change, ...]:
    """Every parameter of the common structure in both recordings, with its difference."""
    base = base_parameters(old.simulation.arm)
    candidates = united((old, new))
    for each in (old, new):
        candidates = separable(each, candidates, base)
    fits = fitted(old, candidates, base), fitted(new, candidates, base)
    rows = [*_of_effects(candidates, *fits), *_of_base(old, base, *fits)]
    adjusted = holm(np.array([each.p_value for each in rows]))
    return tuple(replace(each, p_value=float(p)) for each, p in zip(rows, adjusted, strict=True))


def _degrees(old: Fit, new: Fit) -> int:
    return max(min(old.stretches, new.stretches) - 1, 1)


def _of_effects(candidates: tuple[Candidate, ...], old: Fit, new: Fit) -> list[Change]:
    rows = []
    degrees = _degrees(old, new)
    for candidate, place in zip(candidates, old.places, strict=True):
        sides = [
            parameter_half_widths(candidate, fit.values[place], fit.covariance[place, place], 1.0) for fit in (old, new)
        ]
        for (name, one, spread), (_, other, more) in zip(*sides, strict=True):
            if isinstance(one, float) and isinstance(other, float):
                error = float(np.hypot(float(np.asarray(spread)), float(np.asarray(more))))
                rows.append(_change(candidate.effect, candidate.joint, candidate.joints, name, one, other, error,
                                    candidate.unit(name), degrees))  # fmt: skip
    return rows


def _of_base(old: Diagnosis, base: BaseParameters, first: Fit, second: Fit) -> list[Change]:
    nominal = old.simulation.inertial
    start = np.zeros(len(base)) if nominal is None else base.values(nominal)
    degrees = _degrees(first, second)
    out = []
    for index, name in enumerate(base.sums):
        error = float(np.sqrt(first.covariance[index, index] + second.covariance[index, index]))
        before, after = (float(start[index] + fit.values[index]) for fit in (first, second))
        unit = PARAMETER_UNITS[base.columns[index] % 10]
        out.append(_change("base_parameter", None, (), name, before, after, error, unit, degrees))
    return out


def _change(effect: str, joint: int | None, joints: tuple[int, ...], name: str, old: float, new: float, error: float,
            unit: str, degrees: int) -> Change:  # fmt: skip
    half = float(student.ppf(0.975, degrees)) * error
    p_value = float(2 * student.sf(abs(new - old) / max(error, 1e-300), degrees))
    return Change(effect, joint, joints, name, old, new, (new - old - half, new - old + half), unit, p_value)


def holm(p_values: Array) -> Array:
    """p-values after Holm's (1979) correction, in their order."""
    order = np.argsort(p_values)
    count = len(p_values)
    steps = np.maximum.accumulate((count - np.arange(count)) * p_values[order])
    out = np.empty(count)
    out[order] = np.minimum(steps, 1.0)
    return out
