"""A claim of the paper, what we get instead, and the verdict on it."""

from dataclasses import dataclass
from typing import Literal

Verdict = Literal["reproduced", "not reproduced", "cannot be checked"]
VERDICTS: tuple[Verdict, ...] = ("reproduced", "not reproduced", "cannot be checked")
TOLERANCE = 0.10


@dataclass(frozen=True)
class Claim:
    """place: in the paper. says: what it prints. ours: what the command computed. why: for the verdict.

    A claim that cannot be checked names in `why` the datum that is missing.
    """

    place: str
    says: str
    ours: str
    verdict: Verdict
    why: str


def held(condition: bool) -> Verdict:
    """Reproduced if the condition holds, else not."""
    return "reproduced" if condition else "not reproduced"


def close(ours: float, printed: float) -> bool:
    """Whether a number agrees with the printed one within 10 %."""
    return abs(ours - printed) <= TOLERANCE * abs(printed)


def percent(new: float, old: float) -> float:
    """Change from old to new in per cent of old."""
    return 100 * (new / old - 1)
