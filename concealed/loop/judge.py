"""What a verdict says about a hidden effect: ambiguous at first, and afterwards right, wrong or still open."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

Place = tuple[str, int | None]
Start = Literal["ambiguous", "one name", "another class", "nothing"]
End = Literal["right", "wrong", "open"]


@dataclass(frozen=True)
class Truth:
    """hidden: the effect and its joint. background: what is there as well and may be named."""

    hidden: Place
    background: frozenset[Place] = frozenset()


def truth_of(answer: dict[str, Any]) -> Truth:
    """The truth about a case, from its sealed answer."""
    hidden = answer["injected"][0]
    others = [*answer["background"], *answer["cad_errors"]]
    return Truth((hidden["effect"], hidden["joint"]), frozenset((each["effect"], each["joint"]) for each in others))


def start_of(verdict: dict[str, Any], truth: Truth) -> Start:
    """Whether a first verdict leaves the hidden effect among rivals."""
    groups = [(own, rivals) for own, rivals in _groups(verdict) if truth.hidden in {own, *rivals}]
    if any(rivals for _, rivals in groups):
        return "ambiguous"
    if groups:
        return "one name"
    return "another class" if verdict["findings"] else "nothing"


def suspects(verdict: dict[str, Any], truth: Truth) -> frozenset[Place]:
    """All names of the groups that hold the hidden effect."""
    return frozenset(
        name for own, rivals in _groups(verdict) if truth.hidden in {own, *rivals} for name in (own, *rivals)
    )


def end_of(verdict: dict[str, Any], truth: Truth, suspected: frozenset[Place]) -> End:
    """What became of the suspects of the first verdict.

    right: the hidden effect alone is named, without rivals. wrong: another suspect is claimed, and the hidden effect
    is not among its rivals. open: everything else, a verdict without any of them too.
    """
    groups = [(own, rivals) for own, rivals in _groups(verdict) if own in suspected or truth.hidden in rivals]
    false = [own for own, rivals in groups if own != truth.hidden and truth.hidden not in rivals]
    if any(own not in truth.background for own in false):
        return "wrong"
    return "right" if (truth.hidden, frozenset()) in groups else "open"


def _groups(verdict: dict[str, Any]) -> Iterable[tuple[Place, frozenset[Place]]]:
    for finding in verdict["findings"]:
        rivals = frozenset((each["effect"], each["joint"]) for each in finding["rivals"])
        yield (finding["effect"], finding["joint"]), rivals
