"""What a diagnosis and a comparison write: verdict/1 (`verdict.json`) and comparison/1 (`comparison.json`).

Each format is one model. Whoever writes the file builds the model; whoever reads the file gets it back. The JSON
Schemas in `armlab/schemas` are generated from these models.
"""

import json
from pathlib import Path
from typing import Annotated, Any, Final, Literal

from annotated_types import Ge, Le
from pydantic import BaseModel, ConfigDict, Field

from armlab.common.errors import InputError
from armlab.common.settings import read_json, validate
from armlab.effects.contract import Effect
from armlab.effects.library import EFFECT_IDS

VERDICT_SCHEMA: Final = "verdict/1"
COMPARISON_SCHEMA: Final = "comparison/1"

Status = Literal["mismatch", "none", "inconclusive"]
ComparisonStatus = Literal["changed", "same", "inconclusive"]
FindingKind = Literal["physics", "setup", "link", "unknown"]
EffectName = Annotated[
    str,
    Field(
        description="An id of the vocabulary of effects, or the name of a user's own effect.", examples=list(EFFECT_IDS)
    ),
]
JointNumber = Annotated[int, Ge(1)]
Share = Annotated[float, Ge(0), Le(1)]
Value = float | tuple[float, ...]


def kind_of_effect(effect: Effect) -> FindingKind:
    """The kind of a finding with this effect."""
    if effect.id == "unknown":
        return "unknown"
    return "link" if effect.where == "link" else "physics"


class Entry(BaseModel):
    """Base of all parts of these formats: frozen, strict, finite numbers.

    Keys of a later version are ignored when a file is read. Keys that were not set are not written.
    """

    model_config = ConfigDict(extra="ignore", frozen=True, strict=True, allow_inf_nan=False)

    def content(self) -> dict[str, Any]:
        """The entry as JSON holds it, with the keys that were set."""
        return self.model_dump(mode="json", by_alias=True, exclude_unset=True)

    def to_json(self) -> str:
        """The text of the file."""
        return json.dumps(self.content(), indent=1, allow_nan=False) + "\n"


class ParameterEntry(Entry):
    """A parameter in SI units with its 95 % interval: one pair, or one for each component of a vector.

    value: what has to be added to the simulation; of the servo of a recording of motion only, the number itself.
    simulation: what the simulation has already, where it has a law of this kind there.
    """

    value: Value
    ci95: tuple[Value, ...] | None
    unit: str
    simulation: float | None = None


class WhereEntry(Entry):
    """Where an error is large. variable: the one that orders it best. time: a stretch of the run, s."""

    variable: str | None
    regime: str
    runs: tuple[str, ...] = ()
    time: tuple[float, float] | None = None


class LocatedEntry(Entry):
    """A joint with excess error. share: of the excess error of all joints."""

    joint: JointNumber | None
    share: Share
    where: WhereEntry


class RivalEntry(Entry):
    """Another effect that these data cannot tell from the finding; joint: null for an effect of the whole robot."""

    effect: EffectName
    joint: JointNumber | None


class ClassMember(Entry):
    """One member of a class of names that the data leave open."""

    effect: EffectName
    joint: JointNumber | None
    probability: Share


class SurvivalEntry(Entry):
    """How often a name is found in torque that is simulated anew: of so many with the finding, and without it."""

    returned: int
    simulated: int
    appeared: int
    left_out: int


class FindingEntry(Entry):
    """One named difference between simulation and robot.

    kind: `physics` (an effect of the library), `setup` (the recording or the robot file is read wrongly), `link`
    (payload, inertial parameters) or `unknown`; the first verdicts do not have this key.
    joint: from 1, the link for kind `link`, null for the whole robot. joints: of a coupling, where the torque appears
    and where the motion is. heldout_rms: N m (N), of the model found without the finding, the rest fitted anew, and
    with it. p_value: corrected for all comparisons. form: the law or the quantity. share_of_gap: of the held-out error
    above the noise. minor: in the model and in this list, and of no practical size. probability: of the name.
    class: effects and joints with their probabilities. survival: where it was asked for (`diagnose --survival`).
    """

    effect: EffectName
    kind: FindingKind | None = None
    joint: JointNumber | None
    joints: tuple[JointNumber, ...] = ()
    form: str | None = None
    parameters: dict[str, ParameterEntry]
    equation: str
    heldout_rms_before: float
    heldout_rms_after: float
    p_value: float | None = None
    share_of_gap: float | None = None
    minor: bool | None = None
    probability: Share | None = None
    class_: tuple[ClassMember, ...] | None = Field(default=None, alias="class")
    rivals: tuple[RivalEntry, ...]
    next_experiment: str | None = None
    survival: SurvivalEntry | None = None


class DoubtEntry(Entry):
    """A reading mistake that is not named and that the data do not exclude. measurement: what decides."""

    effect: EffectName
    joints: tuple[JointNumber, ...]
    measurement: str


class UnexplainedEntry(Entry):
    """Structure of a joint that no effect explains. depends_on: variables such as `position_1`."""

    joint: JointNumber | None
    share: float
    depends_on: tuple[str, ...]


class FrictionEntry(Entry):
    """All friction that was found at a joint, whatever its laws: its torque, N m (N), at two speeds, rad/s (m/s).

    speeds: the 10 and 90 % quantiles of the joint's own. ci95: 95 % intervals.
    """

    joint: JointNumber
    speeds: tuple[float, float]
    torque: tuple[float, float]
    ci95: tuple[tuple[float, float], tuple[float, float]]


class LeftEntry(Entry):
    """What is left at a joint on held-out data. rms, noise: N m (N). share_of_torque: of the rms of its torque.

    depends_on: variables that predict part of it. usual: whether real arms leave as much.
    """

    joint: JointNumber
    share_of_torque: float
    rms: float
    noise: float
    depends_on: tuple[str, ...]
    usual: bool


class RecordedEntry(Entry):
    """The same four errors against the torque as recorded, which passed no filter, N m (N)."""

    heldout_rms_before: float
    heldout_rms_after: float
    heldout_rms_named: float
    heldout_rms_identify: float


class CurrentEntry(Entry):
    """How a recorded current of unknown scale and sign follows the torque of a drive: correlations on held-out runs.

    form: with the torque itself, its size or its square. correlation: of the drive found; before: of the simulation's,
    null where it has none; with_damping: of the drive found if it had all damping that was found, null where it has.
    """

    form: Literal["signed", "size", "squared"]
    correlation: float
    before: float | None
    with_damping: float | None


class FitEntry(Entry):
    """Held-out error of a joint against the filtered torque, N m (N).

    before: of the refitted rigid body. after: with the model found, surrogates of unknowns left out. named: with the
    named effects alone. identify: of a plain identification of the same recording (friction, offset and rotor inertia
    of each joint). plain: of plain least squares (rigid links, Coulomb, viscous, offset and rotor inertia), a program
    of its own. noise_floor: of the noise alone. gap_closed: 1 where the model reaches the noise; null where there was
    no gap. replay: error of the position, rad (m), when the commands are sent through the simulation. current: that of
    a recording of motion only.
    """

    joint: JointNumber
    heldout_rms_before: float
    heldout_rms_after: float
    heldout_rms_named: float | None = None
    heldout_rms_identify: float | None = None
    heldout_rms_plain: float | None = None
    noise_floor: float
    gap_closed: float | None
    recorded: RecordedEntry | None = None
    replay_rms_before: float | None = None
    replay_rms_after: float | None = None
    current: CurrentEntry | None = None


class StoryEntry(Entry):
    """Findings with one cause. findings: their places in the list `findings`, from 0."""

    cause: str
    joints: tuple[JointNumber, ...]
    share_of_gap: float
    findings: tuple[Annotated[int, Ge(0)], ...]


class VerdictFile(Entry):
    """The content of `verdict.json` (schema verdict/1).

    status: `none` where the simulation explains the recording down to the noise; the reason of `inconclusive` stands in
    the summary. story: groups of findings, largest first. doubts: ways to read the recording otherwise.
    """

    schema_: Literal["verdict/1"] = Field(alias="schema")
    status: Status
    summary: str
    story: tuple[StoryEntry, ...] | None = None
    located: tuple[LocatedEntry, ...]
    findings: tuple[FindingEntry, ...]
    unexplained: tuple[UnexplainedEntry, ...]
    friction: tuple[FrictionEntry, ...] | None = None
    left: tuple[LeftEntry, ...] | None = None
    doubts: tuple[DoubtEntry, ...] = ()
    fit: tuple[FitEntry, ...]


class ChangeEntry(Entry):
    """One parameter in the recordings. old, new: in the first and in the last; null where only changes are known.

    difference_ci95: 95 % interval of new minus old. ratio: new over old. p_value: of no difference, corrected for all
    that was compared.
    """

    effect: str
    joint: JointNumber | None
    joints: tuple[JointNumber, ...]
    parameter: str
    old: float | None
    new: float | None
    difference: float | None = None
    difference_ci95: tuple[float, float]
    ratio: float | None = None
    ratio_ci95: tuple[float, float] | None = None
    unit: str
    p_value: float
    changed: bool


class DetectableEntry(Entry):
    """The smallest change of a parameter that these recordings would have shown.

    share: of its level, null where there is none.
    """

    effect: str
    joint: JointNumber | None
    parameter: str
    change: float
    unit: str
    share: float | None = None


class TrendEntry(Entry):
    """A parameter that moves over more than two recordings: its value in each, with 95 % intervals.

    kind: `step` where it changed once, `slope` where it grows or falls steadily, `scatter` else. change_point: the
    first recording after the step, from 0. per_day: of a slope whose recordings have dates.
    """

    effect: str
    joint: JointNumber | None
    joints: tuple[JointNumber, ...]
    parameter: str
    unit: str
    values: tuple[float, ...]
    ci95: tuple[tuple[float, float], ...]
    kind: Literal["step", "slope", "scatter"]
    change_point: int | None = None
    per_day: float | None = None


class ComparisonFile(Entry):
    """The content of `comparison.json` (schema comparison/1).

    old, new: names of the first and of the last recording; recordings: of all, dates: as far as they are known.
    level: a parameter changed where its p-value is below it. findings: what changed, parameters as changes. doubtful: a
    change that would be a finding if the runs of one recording differed less. notes: what the recordings hold and the
    comparison does not use.
    """

    schema_: Literal["comparison/1"] = Field(alias="schema")
    status: ComparisonStatus
    summary: str
    old: str
    new: str
    recordings: tuple[str, ...] | None = None
    dates: tuple[str | None, ...] | None = None
    level: float
    findings: tuple[FindingEntry, ...] | None = None
    doubtful: FindingEntry | None = None
    changes: tuple[ChangeEntry, ...]
    smallest_detectable: tuple[DetectableEntry, ...] | None = None
    trends: tuple[TrendEntry, ...] | None = None
    notes: tuple[str, ...] | None = None


def read_verdict_file(path: Path) -> VerdictFile:
    """The checked content of a `verdict.json`; InputError, in one line, where it is wrong."""
    content = read_json(path)
    if not isinstance(content, dict) or content.get("schema") != VERDICT_SCHEMA:
        raise InputError(f"{path} is no verdict: its key 'schema' should be {VERDICT_SCHEMA}")
    return validate(VerdictFile, content, str(path))
