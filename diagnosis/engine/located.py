"""Where the simulation is off: shares of the excess error by joint, and the variable and regime that hold it."""

import numpy as np

from diagnosis.engine.observed import Observed
from diagnosis.result import Located
from recordings.run import Array

BINS = 10  # of a variable, by quantiles
SURE = 3.0  # times the scatter of a joint's excess error between stretches of time
HOLDS = 0.5  # of the excess in one bin: a regime of its own
STRETCH_S = 1.0


def located(residual: Array, floor: Array, observed: Observed) -> tuple[Located, ...]:
    """Joints whose error exceeds the noise. residual: (rows, joints); floor: (joints,), N m, of the noise."""
    power = residual**2 - floor**2
    excess = np.array([_sure(power[:, joint], observed) for joint in range(residual.shape[1])])
    total = float(excess.sum())
    if total <= 0:
        return ()
    order = [int(joint) for joint in np.argsort(-excess) if excess[joint] > 0]
    return tuple(_where(joint, excess[joint] / total, power[:, joint], observed) for joint in order)


def _sure(power: Array, observed: Observed) -> float:
    """Mean excess power, zero where it may be chance: tested between stretches of time, errors being tied."""
    stretches = max(int(len(power) / observed.rate_hz / STRETCH_S), 3)
    means = np.array([part.mean() for part in np.array_split(power, stretches)])
    error = float(np.std(means, ddof=1) / np.sqrt(stretches))
    mean = float(power.mean())
    return mean if mean > SURE * error * np.sqrt(np.log(len(means) + 1)) / 1.5 else 0.0


def _where(joint: int, share: float, power: Array, observed: Observed) -> Located:
    variables = _variables(joint, observed)
    scored = {name: _ordered(power, values) for name, values in variables.items()}
    best = max(scored, key=lambda name: scored[name][0])
    runs = _runs(power, observed)
    return Located(joint + 1, float(share), best, f"{best} {scored[best][1]}", runs, _stretch(power, observed))


def _variables(joint: int, observed: Observed) -> dict[str, Array]:
    own = joint + 1
    velocity = observed.kept("velocity")[:, joint]
    return {
        f"position_{own}": observed.kept("position")[:, joint],
        f"velocity_{own}": velocity,
        f"acceleration_{own}": observed.kept("acceleration")[:, joint],
        f"speed_{own}": np.abs(velocity),
    }


def _ordered(power: Array, values: Array) -> tuple[float, str]:
    """Share of the excess error's scatter that a variable orders, and the regime with most of it."""
    edges = np.quantile(values, np.linspace(0, 1, BINS + 1))
    bins = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, BINS - 1)
    counts = np.bincount(bins, minlength=BINS)
    means = np.bincount(bins, power, BINS) / np.maximum(counts, 1)
    ordered = float(np.average((means - power.mean()) ** 2, weights=counts)) / max(float(np.var(power)), 1e-300)
    high = np.flatnonzero(means > 0.5 * means.max())
    if len(high) >= BINS - 1:
        return ordered, "over its whole range"
    spans = np.split(high, np.flatnonzero(np.diff(high) > 1) + 1)
    text = " and ".join(f"from {edges[each[0]]:.3g} to {edges[each[-1] + 1]:.3g}" for each in spans)
    return ordered, text


def _runs(power: Array, observed: Observed) -> tuple[str, ...]:
    """Runs with at least half of the excess of the worst one."""
    means: dict[str, float] = {}
    for index, name in enumerate(observed.names):
        parts = [power[each.start : each.stop] for each in observed.segments if each.run == index]
        means[name] = float(np.mean(np.concatenate(parts)))
    worst = max(means.values())
    return tuple(name for name, mean in means.items() if mean > 0.5 * worst)


def _stretch(power: Array, observed: Observed) -> tuple[float, float] | None:
    """The tenth of a run that holds more than half of all excess error; None where there is none."""
    total = float(np.sum(np.maximum(power, 0)))
    for each in observed.segments:
        part = np.maximum(power[each.start : each.stop], 0)
        width = max(len(part) // 10, 1)
        sums = np.convolve(part, np.ones(width), mode="valid")
        if total > 0 and sums.max() > HOLDS * total:
            start = observed.time[each.start + int(np.argmax(sums))]
            return float(start), float(start + width / observed.rate_hz)
    return None
