"""What a diagnosis may be told: its level of doubt, its filters, and the guards that keep its claims honest."""

from collections.abc import Iterable
from dataclasses import dataclass, fields, replace
from typing import Literal

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name

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
    """level: chance of any false claim on a recording with nothing missing. least_gain: share of the error variance
    of its joints by which a claim has to lower the error on held-out data. least_evidence: what a name has to add to
    the model's log evidence: about what an effect of twice the size shows that can be detected at all; below, laws
    that resemble one another are still taken for one another. cutoff_hz: of the filter that torque
    and columns share (lower where the sampling rate asks for it). rows_per_cutoff: rows kept in one period of it: so
    few that hardly any frequency is kept which the filter has emptied, for whitening would lift it.
    """

    level: float = 0.01
    least_gain: float = 0.03
    least_evidence: float = 60.0
    cutoff_hz: float = 40.0
    rows_per_cutoff: float = 2.2
    guards: Guards = Guards()
