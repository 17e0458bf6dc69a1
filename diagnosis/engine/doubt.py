"""Is the name of a law right? What it leaves at its joint tells: a law that only resembles it leaves much structure.

Where a surrogate finds more than the law itself explains, the law only resembles what is there, and its name is
withdrawn. Less may be something else at the same joint. Where the surrogate finds little beside what a law explains,
the law is the right one in another form, and what it leaves is no finding of its own.
"""

from collections.abc import Mapping, Sequence

from diagnosis.engine.evidence import Evidence
from diagnosis.engine.remaining import structured
from diagnosis.engine.surrogate import Structure

DOUBT = 1.0  # of the held-out error power that a law explains
INEXACT = 0.25  # of the same: what the form of a law may be wrong by


def doubted(claimed: Mapping[int, Evidence], left: Sequence[Structure]) -> frozenset[int]:
    """The groups or links whose names do not hold; friction and offsets, which every arm has, keep theirs."""
    over = {each.joint: _power(each) for each in left if structured(each)}
    return frozenset(
        number for number, each in claimed.items() if not each.usual and over.get(each.joint, 0.0) > DOUBT * each.gain
    )


def inexact(each: Structure, effects: Mapping[int, Evidence]) -> bool:
    """Whether structure is what the form of a law that is named at this joint leaves."""
    explained = [own.gain for own in effects.values() if own.joint == each.joint and not own.usual]
    return _power(each) <= INEXACT * max(explained, default=0.0)


def _power(each: Structure) -> float:
    """Of what the surrogate predicts, as a share of the error that the model leaves."""
    return each.gain / (1 + each.gain)
