"""A look: real and simulated recordings side by side, how well a classifier tells them apart, and the log of looks."""

import json
from collections import defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.proof.open.likeness.classifier import LikenessArm, Separation, separate
from armlab.proof.open.likeness.features import FEATURES, recording_features
from armlab.proof.open.likeness.real_arms import RealFolder

LOOKS_FILE = "looks.json"
BOUND = ("duration", "rate")  # features whose range the affordable set binds
QUANTILES = (0.1, 0.25, 0.5, 0.75, 0.9)


@dataclass(frozen=True)
class LikenessLook:
    """One comparison, for the log. maker: commit of the maker. tier: which simulated recordings. seed: of their set.

    area, low, high: see `Separation`; free_area, free_low, free_high: the same without the features of `BOUND`.
    strongest: features that the classifier uses most.
    """

    maker: str
    tier: str
    seed: int
    cases: int
    real_arms: int
    area: float
    low: float
    high: float
    free_area: float
    free_low: float
    free_high: float
    strongest: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Likeness:
    """Arms of both sides, and how they separate with all features and without those of `BOUND`."""

    arms: Sequence[LikenessArm]
    separation: Separation
    free: Separation
    left_out: Sequence[str] = field(default_factory=tuple)

    def quantiles(self, real: bool) -> Array:
        """Of each feature over the joints of one side, each arm with the same weight, (features, quantiles)."""
        side = [arm for arm in self.arms if arm.real == real]
        values = np.vstack([arm.values for arm in side])
        weights = np.concatenate([np.full(len(arm.values), 1 / len(arm.values)) for arm in side])
        return np.array([_weighted_quantiles(column, weights) for column in values.T])


def read_real_arms(folders: Iterable[RealFolder]) -> Iterator[LikenessArm | str]:
    """The arms with the features of all their folders; for a folder without features the reason, in one line."""
    found: dict[str, list[Array]] = defaultdict(list)
    for each in folders:
        try:
            found[each.arm].append(recording_features(each.path).values)
        except (DataError, InputError) as error:
            yield f"{each.name}: {error}" if each.licensed else "a folder that is not named: no features"
    for arm, values in found.items():
        yield LikenessArm(arm, True, np.vstack(values))


def read_simulated_arms(folders: Iterable[Path]) -> Iterator[LikenessArm | str]:
    """Each recording folder as an arm of its own; for one without features the reason, in one line."""
    for folder in folders:
        try:
            yield LikenessArm(folder.name, False, recording_features(folder).values)
        except (DataError, InputError) as error:
            yield f"{folder.name}: {error}"


def compare(found: Iterable[LikenessArm | str]) -> Likeness:
    """How well arms of both sides are told apart."""
    every = list(found)
    arms = [each for each in every if isinstance(each, LikenessArm)]
    kept = [place for place, name in enumerate(FEATURES) if name not in BOUND]
    fewer = [LikenessArm(arm.name, arm.real, arm.values[:, kept]) for arm in arms]
    return Likeness(arms, separate(arms), separate(fewer), [each for each in every if isinstance(each, str)])


def look_of(likeness: Likeness, maker: str, tier: str, seed: int) -> LikenessLook:
    """The entry of a comparison in the log."""
    number = {side: sum(arm.real == side for arm in likeness.arms) for side in (True, False)}
    own, free = likeness.separation, likeness.free
    return LikenessLook(
        maker=maker,
        tier=tier,
        seed=seed,
        cases=number[False],
        real_arms=number[True],
        area=own.area,
        low=own.low,
        high=own.high,
        free_area=free.area,
        free_low=free.low,
        free_high=free.high,
        strongest=tuple(np.array(list(FEATURES))[np.argsort(-own.importance)[:3]].tolist()),
    )


def read_looks(folder: Path) -> list[LikenessLook]:
    """The looks so far, oldest first."""
    path = folder / LOOKS_FILE
    if not path.is_file():
        return []
    return [
        LikenessLook(**{**each, "strongest": tuple(each["strongest"])}) for each in json.loads(path.read_text("utf-8"))
    ]


def looks_text(looks: Sequence[LikenessLook]) -> str:
    """The log as JSON."""
    return json.dumps([asdict(each) for each in looks], indent=1) + "\n"


def _weighted_quantiles(values: Array, weights: Array) -> Array:
    order = np.argsort(values)
    reached = np.cumsum(weights[order])
    return np.asarray(np.interp(np.array(QUANTILES) * reached[-1], reached, values[order]))
