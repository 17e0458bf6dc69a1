"""Settings of a diagnosis: the guards that keep its claims honest, and its tuning numbers."""

from collections.abc import Iterable
from dataclasses import dataclass, field, fields, replace
from typing import Literal

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.diagnosis.choice import Weights
from armlab.diagnosis.tuning import Tuning, change_tuning

Baseline = Literal["nominal", "refit", "simulated"]


@dataclass(frozen=True)
class Guards:
    """Each guard as a switch, so that an ablation can show what it is worth.

    prewhitening: errors are taken as coloured. robust_variance: claims are tested by the scatter between blocks of
    time. correction: for everything that was looked at. heldout_gain: a claim has to help on data that took no part.
    same_filter: columns pass the filter of the torque. physics_signs: laws of physics may refuse a claim.
    backward_elimination: what others explain is taken out again. background_start: the search also starts from a
    refit with friction on every joint. unknown: structure that the library leaves may be called unknown.
    """

    prewhitening: bool = True
    robust_variance: bool = True
    correction: bool = True
    heldout_gain: bool = True
    same_filter: bool = True
    physics_signs: bool = True
    backward_elimination: bool = True
    background_start: bool = True
    unknown: bool = True


GUARDS = tuple(each.name for each in fields(Guards))


def guards_without(names: Iterable[str]) -> Guards:
    """All guards but some; InputError for one that there is not."""
    off = dict.fromkeys(names, False)
    for name in off:
        if name not in GUARDS:
            raise InputError(f"--without {name}: no such guard, {suggest_name(name, GUARDS)}")
    return replace(Guards(), **off)


@dataclass(frozen=True)
class Settings:
    """The guards, the tuning numbers of each stage, and the weights of names: None for those learnt on all sets."""

    guards: Guards = Guards()
    tuning: Tuning = field(default_factory=Tuning)
    weights: Weights | None = None


def vary(settings: Settings, name: str, value: object) -> Settings:
    """The settings with another value of one tuning number, as in `vary(settings, "noise.max_order", 8)`.

    Raises InputError, in one line, for an unknown name, a value of a wrong type, or one that cannot be computed with.
    """
    return replace(settings, tuning=change_tuning(settings.tuning, name, value))
