"""Features that bend to anything: splines and random waves (Rahimi and Recht 2007) of the joints' motion and of time.

None of them is from the library: they are to find what has no name.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter

from diagnosis.engine.observed import Observed
from diagnosis.engine.ridge import thirds_of
from recordings.run import Array

HATS, FINE = 8, 16  # piecewise linear functions of a variable
PAIRS = 6  # of other joints
FEW_JOINTS = 4  # an arm with more gets fewer waves a pair
WAVES = 16  # random waves of a pair of variables
SPEEDS = (0.005, 0.02, 0.06, 0.2, 0.6)  # of the top speed: widths of smooth signs of the velocity
PLACES, TURNS = 4, 5  # piecewise linear functions of each of two variables, for their products
HALF, FINEST = 12, 24  # of a position, for what differs from place to place
MEMORIES_S = (0.02, 0.1, 0.5)  # s: of lagged signs, for what depends on the way since a reversal


Part = tuple[Array, tuple[str, ...]]


@dataclass(frozen=True, eq=False)
class Features:
    """values: (rows, features). variables: per feature the names of what it depends on.

    folds: (rows,), which third of the identification rows each belongs to, -1 for none. grams: of each third.
    """

    values: Array
    variables: tuple[frozenset[str], ...]
    folds: NDArray[np.intp]
    grams: tuple[Array, ...]


def features(observed: Observed, joint: int, rng: np.random.Generator) -> Features:
    """Features for one joint at the kept rows."""
    position, velocity, acceleration = (observed.kept(name) for name in ("position", "velocity", "acceleration"))
    waves = WAVES if observed.joints <= FEW_JOINTS else WAVES // 2
    parts: list[Part] = []

    def add(columns: Array, *variables: str) -> None:
        parts.append((columns, variables))

    for other in range(observed.joints):
        add(_hats(position[:, other]), f"position_{other + 1}")
        add(_hats(velocity[:, other]), f"velocity_{other + 1}")
        if other != joint:
            pair = f"position_{joint + 1}", f"position_{other + 1}"
            add(_waves(position[:, [joint, other]], rng, waves), *pair)
            add(_waves(velocity[:, [joint, other]], rng, waves), f"velocity_{joint + 1}", f"velocity_{other + 1}")
            add(
                _waves(np.column_stack([position[:, joint], velocity[:, other]]), rng, waves),
                pair[0],
                f"velocity_{other + 1}",
            )
    for first, second in list(combinations([other for other in range(observed.joints) if other != joint], 2))[:PAIRS]:
        add(_waves(position[:, [first, second]], rng, waves), f"position_{first + 1}", f"position_{second + 1}")
    own = f"velocity_{joint + 1}"
    add(_hats(acceleration[:, joint]), f"acceleration_{joint + 1}")
    add(_waves(np.column_stack([position[:, joint], velocity[:, joint]]), rng), f"position_{joint + 1}", own)
    add(_waves(np.column_stack([velocity[:, joint], acceleration[:, joint]]), rng), own, f"acceleration_{joint + 1}")
    signs = _signs(velocity[:, joint])
    add(signs, own)
    add(_hats(position[:, joint], FINE) * signs[:, 2:3], own, f"position_{joint + 1}")
    add(_lagged(observed, signs[:, 1]), own)
    add(_lagged(observed, velocity[:, joint]), own)
    clock = observed.time
    add(_hats(clock), "time")
    add(np.column_stack([clock, clock**2]) * signs[:, 2:3], own, "time")
    add(np.column_stack([clock, clock**2]) * velocity[:, [joint]], own, "time")
    return _made(observed, joint, parts)


def families(observed: Observed, joint: int, load: Array) -> Iterator[Features]:
    """Few features each, of one kind of dependence. load: torque of the model at the joint, (rows,), N m.

    What depends on little drowns in the noise of what does not matter where hundreds of features are taught at once.
    """
    position, velocity, acceleration = (observed.kept(name) for name in ("position", "velocity", "acceleration"))
    signals = ("torque", "position", "velocity", "acceleration")
    torque, place, speed, change = (f"{name}_{joint + 1}" for name in signals)
    own, signs = velocity[:, joint], _signs(velocity[:, joint])
    turn = signs[:, 2:3]
    loaded = [
        (_hats(load), (torque,)),
        (load[:, None] * _hats(own), (torque, speed)),
        (turn * _hats(load), (torque, speed)),
    ]
    fast = [_hats(own, FINE), signs, _lagged(observed, signs[:, 1]), _lagged(observed, own)]
    mapped = [turn * _hats(position[:, joint], FINEST), own[:, None] * _hats(position[:, joint], HALF)]
    yield _made(observed, joint, loaded)
    yield _made(observed, joint, [(columns, (speed,)) for columns in fast])
    yield _made(observed, joint, [(columns, (place, speed)) for columns in mapped])
    yield _made(observed, joint, [(_hats(position[:, joint], FINEST), (place,))])
    yield _made(observed, joint, [(_products(own, acceleration[:, joint], TURNS), (speed, change))])
    for other in range(observed.joints):
        if other != joint:
            theirs = f"velocity_{other + 1}"
            both = _products(position[:, joint], position[:, other], PLACES)
            smooth = _signs(velocity[:, other])
            moved = [_hats(velocity[:, other]), smooth, _lagged(observed, smooth[:, 2])]
            moved.append(_lagged(observed, velocity[:, other]))
            yield _made(observed, joint, [(both, (place, f"position_{other + 1}"))])
            yield _made(observed, joint, [(columns, (theirs,)) for columns in moved])


def _made(observed: Observed, joint: int, parts: Sequence[Part]) -> Features:
    """Features of columns (rows, count) with the variables that they depend on; constant ones left out."""
    matrix = np.column_stack([columns for columns, _ in parts])
    names = [frozenset(variables) for columns, variables in parts for _ in range(columns.shape[1])]
    matrix = matrix - matrix.mean(axis=0)
    spread = matrix.std(axis=0)
    kept = spread > 1e-9
    chosen = tuple(name for name, wanted in zip(names, kept, strict=True) if wanted)
    scaled, thirds = matrix[:, kept] / spread[kept], thirds_of(observed, joint)
    grams = tuple(scaled[thirds == fold].T @ scaled[thirds == fold] for fold in range(3))
    return Features(scaled, chosen, thirds, grams)


def _hats(values: Array, hats: int = HATS) -> Array:
    """Piecewise linear functions between quantiles of the values, (rows, hats)."""
    knots = np.unique(np.quantile(values, np.linspace(0, 1, hats)))
    if len(knots) < 3:
        return np.empty((len(values), 0))
    return np.column_stack([np.interp(values, knots, unit) for unit in np.eye(len(knots))])


def _products(one: Array, other: Array, hats: int) -> Array:
    """Every function of one variable times every one of the other, (rows, products)."""
    first, second = _hats(one, hats), _hats(other, hats)
    return (first[:, :, None] * second[:, None, :]).reshape(len(one), first.shape[1] * second.shape[1])


def _waves(values: Array, rng: np.random.Generator, count: int = WAVES) -> Array:
    spread = values.std(axis=0)
    scaled = (values - values.mean(axis=0)) / np.where(spread > 0, spread, 1)
    frequency = rng.normal(0, 1.0, (values.shape[1], count))
    return np.asarray(np.cos(scaled @ frequency + rng.uniform(0, 2 * np.pi, count)))


def _signs(velocity: Array) -> Array:
    top = max(float(np.abs(velocity).max()), 1e-9)
    return np.column_stack([np.tanh(velocity / (speed * top)) for speed in SPEEDS])


def _lagged(observed: Observed, values: Array) -> Array:
    """First-order lags of a signal, run by run."""
    lengths = np.cumsum([len(each.torque) for each in observed.signals])[:-1]
    out = []
    for memory in MEMORIES_S:
        keep = float(np.exp(-1 / (memory * observed.rate_hz)))
        parts = [lfilter([1 - keep], [1, -keep], part, zi=[keep * part[0]])[0] for part in np.split(values, lengths)]
        out.append(np.concatenate(parts))
    return np.column_stack(out)
