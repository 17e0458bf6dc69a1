"""The comparison of recordings of one robot, step by step.

`compare` is the whole flow: look for changes of rigid links and friction (`pool_plainly`); where there are none,
diagnose each recording and look for finer ones beside a common model of all that was found (`pool_recordings`); name
them (`name_changes`), and say what would have been seen (`list_table`).
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import date
from itertools import combinations

import numpy as np

from armlab.common.errors import DataError, InputError
from armlab.common.notebook import notebook_html
from armlab.diagnosis.changes.changes import ChangeTable, Tested, make_plain_table, make_table
from armlab.diagnosis.changes.named import NamedChange, list_table, name_changes
from armlab.diagnosis.changes.numbers import Change, common_values, list_movements
from armlab.diagnosis.changes.pooled import Pooled, follow_levels, pool_plainly, pool_recordings, unite_candidates
from armlab.diagnosis.changes.soundness import SoundChanges, find_sound_changes
from armlab.diagnosis.changes.trends import Trend, find_trends, recording_dates
from armlab.diagnosis.formats import ComparisonStatus
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Settings
from armlab.diagnosis.torque.diagnose import diagnose, find_setup
from armlab.diagnosis.torque.rows.simulation import Simulation, model_baseline, read_simulation
from armlab.recordings.plain_least_squares import COMPARED_HZ, fit_plain_rows, prepare_rows
from armlab.recordings.reading.mistakes import TORQUE
from armlab.recordings.reading.reading import Mistake
from armlab.recordings.recording import Recording
from problem.arm import Arm

RUNS_DIFFER = "The runs of one recording differ as much as the recordings do: record more runs of each."
OTHER_STATES = (
    "The recordings differ, but move in other places or at other speeds, where the model may lack something else: "
    "record the same motion again."
)
SHARED = 0.99  # share of the rows from which on all recordings were in the same states
FOLLOW_ROUNDS = 3  # in which columns follow what is common beside the changes, before names have to agree
NAMED_BY_COMPARISONS = ("time_delay", "channel_skew", "encoder_offset", "base_tilt")
LEAST_UNIT = 10.0  # factor of torque that is another unit, and no change of a drive
NOTHING_EXPLAINED = 0.9  # of the scatter of the torque, that plain least squares leaves of noise, or more
GEOMETRY_TOLERANCE = 1e-6  # rad (m): geometry that counts as that of the same robot


@dataclass(frozen=True, eq=False)
class Comparison:
    """simulation: of all recordings. diagnoses: of each recording alone; none where links and friction show a change.

    findings: what changed, the surest first. changes: every parameter compared.

    reason: of an inconclusive comparison. doubtful: what makes it so where the runs of one recording differ as much as
    the recordings, or these were in other states. notes: sentences on what was not used. trends: of more than two
    recordings, each parameter that moves; dates: of the recordings.
    """

    status: ComparisonStatus
    recordings: tuple[Recording, ...]
    simulation: Simulation
    diagnoses: tuple[Diagnosis, ...] = ()
    findings: tuple[NamedChange, ...] = ()
    changes: tuple[Change, ...] = ()
    reason: str = ""
    doubtful: NamedChange | None = None
    notes: tuple[str, ...] = ()
    trends: tuple[Trend, ...] = ()
    dates: tuple[date | None, ...] = ()

    @property
    def arm(self) -> Arm:
        """Of all recordings: the simulation's, with the names of its joints."""
        return self.simulation.arm

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the recordings."""
        return tuple(each.name for each in self.recordings)

    def __repr__(self) -> str:
        """The status, what changed, and how much was compared."""
        lines = [f"Comparison of {', '.join(map(repr, self.names))}: {self.status}"]
        if self.doubtful is not None:
            lines.append(f"  perhaps {self.doubtful.effect}@{self.doubtful.joint}: {self.doubtful.equation}")
        if self.status == "inconclusive":
            return "\n".join([*lines, f"  {self.reason}"])
        lines += [f"  {each.effect}@{each.joint}: {each.equation}" for each in self.findings]
        return "\n".join([*lines, f"  parameters compared: {len(self.changes)}"])

    def _repr_html_(self) -> str:
        rows = [(each.effect, "" if each.joint is None else each.joint, each.equation) for each in self.findings]
        title = f"Comparison of {', '.join(self.names)}: {self.status}"
        text = self.reason or f"parameters compared: {len(self.changes)}"
        return notebook_html(title, text, ("effect", "joint", "change"), rows)


def compare(
    old: Recording,
    new: Recording,
    *more: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    dates: Sequence[date] = (),
    progress: Callable[[str], None] = lambda message: None,
) -> Comparison:
    """What changed from the first recording to the later ones.

    dates: of the recordings; those of their files if left out. Raises InputError where the recordings are not of one
    robot, or dates are not as many.
    """
    for other in (new, *more):
        check_same_robot(old, other)
    known_dates = recording_dates((old, new, *more), dates)
    without_torque = frozenset.intersection(*(each.arm.unmeasured for each in (old, new, *more)))
    arm = replace(old.arm, unmeasured=without_torque)  # a joint that some recordings have torque of tells a change
    recordings = tuple(replace(each, arm=arm, simulation=old.simulation) for each in (old, new, *more))
    own = baseline or model_baseline(old)
    progress("reading the recordings rightly")
    for each in recordings:
        reason = _reason_misread(each, own)
        if reason is not None:
            return Comparison("inconclusive", recordings, read_simulation(recordings[0], own), (), reason=reason)

    def diagnose_all() -> list[Diagnosis]:
        diagnoses: list[Diagnosis] = []
        for number in range(len(recordings)):
            diagnoses.append(_diagnose_once(recordings, diagnoses, own, seed, _progress_of(number + 1, progress)))
        return diagnoses

    return compare_with(recordings, diagnose_all, baseline, known_dates, progress)


def _reason_misread(recording: Recording, baseline: Baseline) -> str | None:
    """Why a recording cannot be compared as it is read; None where it can."""
    setup = find_setup(recording, baseline, Settings(), lambda message: None)
    if setup is not None and any(_is_no_change(each.mistake) for each in setup.mistakes):
        return f"{recording.name}: {setup.sentence} Diagnose it alone, and compare what its corrected/ holds."
    if baseline != "simulated" and _explains_nothing(recording):
        return f"{recording.name}: links and friction explain no joint's torque: another robot, or torque that is none?"
    return None


def _is_no_change(mistake: Mistake) -> bool:
    """Whether no comparison could name it: a scale of the torque, a delay, a zero and a tilt are changes, too."""
    if mistake.effect == "unit_error" and mistake.form == TORQUE:
        factor = mistake.value("factor")
        return max(factor, 1 / factor) >= LEAST_UNIT
    return mistake.effect not in NAMED_BY_COMPARISONS


def _explains_nothing(recording: Recording) -> bool:
    """Whether plain least squares leaves nearly all of the torque of every joint to which it is fitted."""
    rows = [prepare_rows(run, COMPARED_HZ) for run in recording.runs]
    try:
        model = fit_plain_rows(recording.arm, rows, COMPARED_HZ)
    except ValueError:
        return False
    moved = [each for each in rows if len(each.torque)]
    torque = np.concatenate([each.torque for each in moved])
    left = torque - np.concatenate([model.layout.matrix(each.motion) @ model.values for each in moved])
    measured = list(recording.arm.measured)
    left, torque = left[:, measured], torque[:, measured]
    return bool(np.all(np.std(left, axis=0) > NOTHING_EXPLAINED * np.std(torque, axis=0)))


def compare_with(
    recordings: Sequence[Recording],
    diagnose_all: Callable[[], Sequence[Diagnosis]],
    baseline: Baseline | None,
    dates: Sequence[date | None],
    progress: Callable[[str], None] = lambda message: None,
) -> Comparison:
    """What changed between recordings of one robot. diagnose_all: diagnoses each, which takes most of the time."""
    simulation, settings = read_simulation(recordings[0], baseline or model_baseline(recordings[0])), Settings()
    progress("looking for changes of links and friction")
    seen = look_plainly(recordings, simulation, settings)
    diagnoses: Sequence[Diagnosis] = ()
    if seen is None or not seen.sound.named:
        diagnoses = diagnose_all()
        none = Comparison("inconclusive", tuple(recordings), simulation, tuple(diagnoses))
        failed = next((each for each in diagnoses if each.model is None), None)
        if failed is not None:
            return replace(none, reason=f"{failed.recording.name}: {failed.reason}")
        progress("looking for other changes")
        try:
            rich = _look(pool_recordings(recordings, unite_candidates(diagnoses), simulation, settings), make_table)
        except DataError as error:
            if seen is None:
                return replace(none, reason=str(error))
            rich = seen  # what links and friction show is all that these recordings tell
        if seen is None or rich.sound.named or not seen.sound.elsewhere:
            seen = rich
    return conclude(seen, recordings, diagnoses, tuple(_notes(recordings, baseline)), dates)


@dataclass(frozen=True, eq=False)
class ChangeLook:
    """A table of recordings and the changes that it shows."""

    pooled: Pooled
    table: ChangeTable
    sound: SoundChanges

    @property
    def groups(self) -> set[int]:
        """Of the named changes."""
        return {each.group for each in self.sound.named}


def look_plainly(recordings: Sequence[Recording], simulation: Simulation, settings: Settings) -> ChangeLook | None:
    """What rigid links and friction show; None where no run is long enough."""
    try:
        return _look(pool_plainly(recordings, simulation, settings), make_plain_table)
    except DataError:
        return None


def _look(pooled: Pooled, table_of: Callable[[Pooled], ChangeTable]) -> ChangeLook:
    """The changes, with columns that follow what is common beside them.

    Where too few rows are in states that all recordings were in, there are none.
    """
    table = table_of(pooled)
    few = pooled.shared_share < pooled.tuning.least_shared
    sound = SoundChanges(()) if few else find_sound_changes(pooled, table)
    look = _followed(ChangeLook(pooled, table, sound), table_of)
    if look.sound.named or look.sound.doubtful is not None or pooled.shared_share > SHARED:
        return look
    every = replace(pooled, only_shared=False)
    table_of_all = table_of(every)
    found = find_sound_changes(every, table_of_all).named
    surest = max(found, key=table_of_all.log_odds, default=None)
    if surest is None:
        return look
    return ChangeLook(every, table_of_all, SoundChanges((), surest, elsewhere=True))


def _followed(look: ChangeLook, table_of: Callable[[Pooled], ChangeTable]) -> ChangeLook:
    """The look with columns that follow what is common beside its names, until these stay.

    Where no name is left beside such columns, nothing changed; where other names come and go, the first that followed.
    """
    looks = [look]
    while looks[-1].sound.named and len(looks) <= FOLLOW_ROUNDS:
        last = looks[-1]
        pooled = follow_levels(last.pooled, common_values(last.table, last.sound.named)[last.table.model])
        table = table_of(pooled)
        looks.append(ChangeLook(pooled, table, find_sound_changes(pooled, table)))
        if looks[-1].groups == last.groups:
            return looks[-1]
    return looks[min(1, len(looks) - 1)] if looks[-1].sound.named else looks[-1]


def conclude(
    seen: ChangeLook,
    recordings: Sequence[Recording],
    diagnoses: Sequence[Diagnosis],
    notes: tuple[str, ...],
    dates: Sequence[date | None],
) -> Comparison:
    """The changes with their names and numbers."""
    pooled, table, sound = seen.pooled, seen.table, seen.sound
    named = name_changes(pooled, table, sound.named)
    doubtful = () if sound.doubtful is None else name_changes(pooled, table, [sound.doubtful])
    return Comparison(
        "changed" if named else "inconclusive" if doubtful else "same",
        tuple(recordings),
        pooled.design.simulation,
        tuple(diagnoses),
        named,
        list_table(pooled, table, sound.named),
        reason="" if not doubtful else OTHER_STATES if sound.elsewhere else RUNS_DIFFER,
        doubtful=next(iter(doubtful), None),
        notes=notes,
        trends=_find_trends(pooled, table, sound.named, dates),
        dates=tuple(dates),
    )


def _find_trends(
    pooled: Pooled, table: ChangeTable, found: tuple[Tested, ...], dates: Sequence[date | None]
) -> tuple[Trend, ...]:
    """How what changed moves over more than two recordings."""
    if len(dates) < 3:
        return ()
    movements = [movement for each in found for movement in list_movements(pooled, table, found, each)]
    return find_trends(movements, dates)


def _diagnose_once(
    recordings: Sequence[Recording],
    known: Sequence[Diagnosis],
    baseline: Baseline,
    seed: int,
    progress: Callable[[str], None],
) -> Diagnosis:
    """The diagnosis of the next recording; that of an earlier one where both hold the same rows."""
    own = recordings[len(known)]
    for diagnosis, other in zip(known, recordings, strict=False):
        if _same_rows(own, other):
            return replace(diagnosis, recording=own)
    return diagnose(own, baseline, seed, progress=progress)


def _same_rows(one: Recording, other: Recording) -> bool:
    return len(one.runs) == len(other.runs) and all(
        a.role == b.role
        and a.samples == b.samples
        and all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("time", "position", "torque"))
        for a, b in zip(one.runs, other.runs, strict=True)
    )


def _progress_of(number: int, progress: Callable[[str], None]) -> Callable[[str], None]:
    return lambda message: progress(f"recording {number}: {message}")


def _notes(recordings: Sequence[Recording], baseline: Baseline | None) -> Iterator[str]:
    """What the recordings hold and the comparison does not use, and those that hold the same rows."""
    for one, other in combinations(recordings, 2):
        if _same_rows(one, other):
            yield f"{one.name} and {other.name} hold the same rows: nothing can differ between them."
    runs = [run for each in recordings for run in each.runs]
    if baseline == "simulated":
        yield "The columns of simulated_torque are the simulation; what they lack in all recordings alike is no change."
    elif any(run.simulated_torque is not None for run in runs):
        yield "The columns of simulated_torque are not used: give --baseline simulated to take them as the simulation."
    if any(run.simulated_position is not None for run in runs):
        yield "The columns of simulated_position are not used: a comparison of torques takes the measured motion."


def check_same_robot(old: Recording, new: Recording) -> None:
    """Raises InputError for recordings of arms with other joints."""
    pairs = zip(old.arm.joints, new.arm.joints, strict=False)
    alike = len(old.arm) == len(new.arm) and all(
        one.kind == other.kind
        and np.allclose(one.before, other.before, atol=GEOMETRY_TOLERANCE)
        and np.allclose(one.after, other.after, atol=GEOMETRY_TOLERANCE)
        for one, other in pairs
    )
    if not alike:
        raise InputError(f"{old.name} is of {old.arm.name}, {new.name} of {new.arm.name}: not the same geometry")
