"""What a verdict tells, as facts are held against it: by which names a finding is stated, and with which number."""

from collections.abc import Set
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import Field

from armlab.common.settings import read_json, validate
from armlab.common.told import MAX_CLASS_NAMES, MIN_CAUSE_PROBABILITY, MIN_NAME_PROBABILITY
from armlab.diagnosis.formats import ClassMember, Entry, ParameterEntry

Rank = Literal["named", "class", "cause", "minor", "missed", "below"]
FACT_RANKS: tuple[Rank, ...] = ("named", "class", "cause", "minor", "missed")  # best first
MAIN_NUMBER = {
    "payload": "mass",
    "torque_gain_error": "gain",
    "torque_offset": "offset",
    "command_offset": "offset",
    "rotor_inertia": "inertia",
    "clock_error": "factor",
    "controller_gain_error": "kp",
}
USUAL_NUMBER = "level"
SETUP = "setup"


class FindingAsTold(Entry):
    """A finding as far as it is judged. minor: found, and not told. kind: `setup` for a reading mistake."""

    effect: str
    kind: str | None = None
    joint: int | None = None
    joints: tuple[int, ...] = ()
    parameters: dict[str, ParameterEntry] = Field(default_factory=dict)
    probability: float | None = None
    class_: tuple[ClassMember, ...] | None = Field(default=None, alias="class")
    minor: bool = False

    @property
    def places(self) -> frozenset[int | None]:
        """The joints it concerns; None for the whole robot."""
        return frozenset({self.joint, *self.joints})

    @property
    def label(self) -> str:
        """Effect and joint, for a list."""
        return f"{self.effect}@{self.joint}"


class FrictionRow(Entry):
    """All friction told of a joint: torque, N m (N), at rising speeds, rad/s (m/s)."""

    joint: int
    speeds: tuple[float, ...]
    torque: tuple[float, ...]


class ToldChange(Entry):
    """A parameter of a comparison. ratio: new over old; intervals hold 95 %."""

    effect: str
    joint: int | None = None
    old: float | None = None
    new: float | None = None
    ratio: float | None = None
    ratio_ci95: tuple[float, float] | None = None
    difference_ci95: tuple[float, float] | None = None
    changed: bool = False


class ToldVerdict(Entry):
    """A verdict of a recording, or of a comparison, as far as it is judged; other keys do not matter."""

    status: str
    summary: str = ""
    findings: tuple[FindingAsTold, ...] | None = None
    friction: tuple[FrictionRow, ...] | None = None
    changes: tuple[ToldChange, ...] | None = None

    @property
    def found(self) -> tuple[FindingAsTold, ...]:
        """The findings; none where the file has no such list."""
        return self.findings or ()


def read_told(path: Path) -> ToldVerdict:
    """A `verdict.json` or `comparison.json`, of a later version, too; InputError, in one line, where it is wrong."""
    return validate(ToldVerdict, read_json(path), str(path))


class StatedFact(Entry):
    """How a finding is told, and by which names together."""

    rank: Rank
    names: frozenset[str]


def statement_of(finding: FindingAsTold, friction: Set[str]) -> StatedFact:
    """By its probability (none given: 1): a name, the fewest of its names that reach 0.9 together, or a cause.

    friction: effects whose laws count together for a cause. `below` is too improbable to be told at all.
    """
    own = frozenset({finding.effect})
    if finding.minor:
        return StatedFact(rank="minor", names=own)
    probability = 1.0 if finding.probability is None else finding.probability
    if probability >= MIN_NAME_PROBABILITY:
        return StatedFact(rank="named", names=own)
    members = [each for each in finding.class_ or () if each.effect != "unknown" and each.joint in finding.places]
    names, total = set[str](), 0.0
    for member in sorted(members, key=lambda each: -each.probability)[:MAX_CLASS_NAMES]:
        names.add(member.effect)
        total += member.probability
        if total >= MIN_NAME_PROBABILITY:
            return StatedFact(rank="class" if finding.effect in names else "below", names=frozenset(names))
    laws = sum(each.probability for each in members if each.effect in friction) if finding.effect in friction else 0.0
    return StatedFact(rank="cause" if max(probability, laws) >= MIN_CAUSE_PROBABILITY else "below", names=own)


def number_of(finding: FindingAsTold, name: str | None = None) -> tuple[float, float] | None:
    """The interval of a finding's main number, or of the one of that name, signs dropped; None where it has none."""
    parameter = finding.parameters.get(name or MAIN_NUMBER.get(finding.effect, USUAL_NUMBER))
    if parameter is None or not isinstance(parameter.value, float | int):
        return None
    low, high = _scalars(parameter)
    return (min(abs(low), abs(high)) if low * high > 0 else 0.0), max(abs(low), abs(high))


def _scalars(parameter: ParameterEntry) -> tuple[float, float]:
    """The interval of a scalar parameter; the number twice where it has none."""
    ends = [each for each in parameter.ci95 or () if isinstance(each, float | int)]
    value = parameter.value
    assert isinstance(value, float | int)
    return (ends[0], ends[1]) if len(ends) == 2 else (value, value)


def friction_at(
    verdict: ToldVerdict, told: tuple[FindingAsTold, ...], joint: int, speed: float, friction: Set[str]
) -> float | None:
    """All told friction of a joint at a speed, N m (N); None where nothing is told or a law has no value there.

    told: the findings that are told. A row `friction` of the verdict, where it has one, comes first.
    """
    for row in verdict.friction or ():
        if row.joint == joint:
            return _last_line(row, speed)
    laws = [each for each in told if joint in each.places and (each.effect in friction or each.effect == "backlash")]
    parts = [_friction_of(each, speed) for each in laws]
    known = [each for each in parts if each is not None]
    return sum(known) if parts and len(known) == len(parts) else None


def _last_line(row: FrictionRow, speed: float) -> float:
    """The value at a speed of the line through the last two points of a row."""
    (first, last), (low, high) = row.speeds[-2:], row.torque[-2:]
    return low + (high - low) * (speed - first) / (last - first) if last > first else high


def _friction_of(finding: FindingAsTold, speed: float) -> float | None:
    """Torque of one law at a speed: the mean of both directions, a power of the speed, or a level."""
    directions = [size for name in ("positive", "negative") for size in [_size(finding, name)] if size is not None]
    if directions:
        return sum(directions) / len(directions)
    coefficient = _size(finding, "coefficient")
    if finding.effect in ("viscous_friction", "nonlinear_viscous_friction") and coefficient is not None:
        exponent = _size(finding, "exponent") or 1.0
        return coefficient * float(np.power(speed, exponent))
    return _size(finding, "level")


def _size(finding: FindingAsTold, name: str) -> float | None:
    parameter = finding.parameters.get(name)
    if parameter is None or not isinstance(parameter.value, float | int):
        return None
    return float(abs(parameter.value))
