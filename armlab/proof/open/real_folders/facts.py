"""What is known of recordings (schema facts/1): which effects are in them, what else may be said, what must not."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Literal, Self

from annotated_types import Ge, Gt, Len
from pydantic import Field, model_validator

from armlab.common.errors import InputError
from armlab.common.settings import Settings, read_yaml, suggest_name, validate
from armlab.effects.library import WITHOUT_FAMILY, library
from armlab.recordings.reading.words import NAMES as READING_MISTAKES

FACTS_SCHEMA = "facts/1"
FRICTION_GROUP = "friction"  # its effects are one cause: all friction of a joint is judged together
NO_LICENCE = "none"
NO_TORQUE = "no_torque"  # a channel that holds no torque; a fact that no verdict can state yet

JointNumber = Annotated[int, Ge(1)]
Positive = Annotated[float, Gt(0)]
Range = tuple[float, float]
Effects = Annotated[tuple[str, ...], Len(min_length=1)]
Joints = Annotated[tuple[JointNumber, ...], Len(min_length=1)]
Percents = Annotated[tuple[Annotated[float, Ge(0)], ...], Len(min_length=1)]


class KnownFact(Settings):
    """An effect that is in a recording: one of `effect` (effects or groups) at this joint, null for the whole robot.

    value: range that the interval of the number told has to touch, SI units, signs dropped; width: its largest width.
    torque: N m (N), range of all friction told at this joint, at `speed`, rad/s (m/s). strong: the data show it so
    clearly that missing it is wrong.
    """

    effect: Effects
    joint: JointNumber | None
    value: Range | None = None
    width: Positive | None = None
    speed: Positive | None = None
    torque: Range | None = None
    strong: bool = False

    @model_validator(mode="after")
    def _check_torque(self) -> Self:
        if (self.speed is None) != (self.torque is None):
            raise ValueError("speed and torque belong together: give both or none")
        return self


class AllowedFact(Settings):
    """What is neither right nor wrong. joints: null for any place. value: of `parameter`; outside of it is wrong."""

    effect: Effects
    joints: Joints | None = None
    parameter: str | None = None
    value: Range | None = None


class ReadingFact(Settings):
    """A reading mistake that is right or fair to tell, at these joints, with a number in this range."""

    effect: str
    joints: Joints | None = None
    value: Range | None = None


class ChangedFact(Settings):
    """What changed from old to new. factor: new / old, or difference: new - old, SI units: the range to touch.

    errors: by how many standard errors plain least squares sees it.
    """

    effect: Effects
    joint: JointNumber | None
    quantity: str | None = None
    factor: Range | None = None
    difference: Range | None = None
    errors: Positive

    @model_validator(mode="after")
    def _check_size(self) -> Self:
        if (self.factor is None) == (self.difference is None):
            raise ValueError("give either factor or difference")
        return self


class RecordingFacts(Settings):
    """What is known of one recording or of a pair.

    licence: `none` keeps its rows out of every page but the local one. never: effects that contradict a documented
    fact. low_pass: cut-off at which torque is compared, Hz.
    """

    licence: str | None = None
    never: tuple[str, ...] = ()
    low_pass: Positive | None = None

    @property
    def licensed(self) -> bool:
        """Whether rows about it may be published."""
        return self.licence != NO_LICENCE


class SingleFacts(RecordingFacts):
    """What is known of one recording. abstain: an inconclusive verdict is right, too.

    percent: what plain least squares leaves at each joint, held out, of the filtered torque; `none` where it is no
    yardstick.
    """

    known: tuple[KnownFact, ...] = ()
    allowed: tuple[AllowedFact, ...] = ()
    setup: tuple[ReadingFact, ...] = ()
    abstain: bool = False
    percent: Percents | Literal["none"] | None = None


class PairFacts(RecordingFacts):
    """What is known of an old and a new recording; nothing changed where `changed` is empty.

    same_is_fair: a verdict that sees no change is not wrong.
    """

    changed: tuple[ChangedFact, ...] = ()
    allowed: tuple[AllowedFact, ...] = ()
    same_is_fair: bool = False


class FactsFile(Settings):
    """The content of a facts file. groups: names for lists of effects. singles, pairs: by the name of the folder."""

    schema_: Literal["facts/1"] = Field(alias="schema")
    groups: dict[str, Effects] = Field(default_factory=dict)
    singles: dict[str, SingleFacts] = Field(default_factory=dict)
    pairs: dict[str, PairFacts] = Field(default_factory=dict)

    def effects(self, names: Sequence[str]) -> frozenset[str]:
        """The effects that are meant by effects and groups."""
        return frozenset(effect for name in names for effect in self.groups.get(name, (name,)))

    @property
    def friction(self) -> frozenset[str]:
        """The effects that count as friction."""
        return self.effects([FRICTION_GROUP])

    def of(self, name: str) -> SingleFacts | PairFacts | None:
        """What is known of a folder, if anything is."""
        return self.singles.get(name) or self.pairs.get(name)


def read_facts(path: Path) -> FactsFile:
    """The checked content of a facts file; InputError, in one line, where it is wrong."""
    content = read_yaml(path)
    if not isinstance(content, dict) or content.get("schema") != FACTS_SCHEMA:
        raise InputError(f"{path} is no facts file: its key 'schema' should be {FACTS_SCHEMA}")
    facts = validate(FactsFile, content, str(path))
    known = [*(family.effect for family in library()), *WITHOUT_FAMILY]
    mistakes = [*READING_MISTAKES, NO_TORQUE]
    for place, name, is_mistake in _named_effects(facts):
        right = mistakes if is_mistake else [*known, *facts.groups] if not place.startswith("groups") else known
        if name not in right:
            raise InputError(f"unknown effect '{name}' in {path} at {place}: {suggest_name(name, right)}")
    twice = sorted(set(facts.singles) & set(facts.pairs))
    if twice:
        raise InputError(f"'{twice[0]}' stands under singles and under pairs in {path}: a folder is one of them")
    return facts


def _named_effects(facts: FactsFile) -> Iterator[tuple[str, str, bool]]:
    """Every effect with its place in the file, and whether it is a reading mistake."""
    yield from ((f"groups.{group}", name, False) for group, names in facts.groups.items() for name in names)
    for name, single in facts.singles.items():
        yield from _effects_of(f"singles.{name}", known=single.known, allowed=single.allowed)
        yield from ((f"singles.{name}.never", effect, False) for effect in single.never)
        yield from ((f"singles.{name}.setup", fact.effect, True) for fact in single.setup)
    for name, pair in facts.pairs.items():
        yield from _effects_of(f"pairs.{name}", changed=pair.changed, allowed=pair.allowed)
        yield from ((f"pairs.{name}.never", effect, False) for effect in pair.never)


def _effects_of(
    place: str, **lists: Sequence[KnownFact | AllowedFact | ChangedFact]
) -> Iterator[tuple[str, str, bool]]:
    for key, entries in lists.items():
        for number, entry in enumerate(entries):
            yield from ((f"{place}.{key}[{number}]", name, False) for name in entry.effect)
