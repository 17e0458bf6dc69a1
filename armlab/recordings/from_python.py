"""Imports from scripts and notebooks: of files or DataFrames, with the options of `armlab recording import`."""

import atexit
import re
import shutil
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

import numpy as np

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.clock import MIN_PART_SAMPLES
from armlab.recordings.given import read_recording
from armlab.recordings.imports.files import describe_plan, write_plan
from armlab.recordings.imports.frames import table_of_frame
from armlab.recordings.imports.plan import ReadSources, plan_import
from armlab.recordings.imports.sources import ReadOptions, Source, read_sources
from armlab.recordings.motion import MotionRecording
from armlab.recordings.recording import Finding, Recording
from problem.robot_file import built_in_arms

if TYPE_CHECKING:
    import pandas as pd

Columns = str | Sequence[str]
"""Names of columns, or one text with commas between names and patterns, like `q*`."""


@dataclass(frozen=True)
class Place:
    """The folder of a recording. is_temporary: whether it goes with the Python process."""

    folder: Path
    is_temporary: bool


class ImportOptions(TypedDict, total=False):
    """Options of an import, see `import_recording`."""

    time: Columns
    position: Columns
    torque: Columns
    velocity: Columns
    temperature: Columns
    voltage: Columns
    link_position: Columns
    reference_position: Columns
    reference_velocity: Columns
    simulated_torque: Columns
    simulated_position: Columns
    units: Mapping[str, str]
    gains: Sequence[float]
    gear_ratio: Sequence[float]
    motor_side: str
    joints: Columns
    tip: str
    lock: Mapping[str, float]
    repair: bool
    separator: str
    decimal: str
    topic: str
    command_topic: str


def import_recording(
    files: str | Path | Sequence[str | Path],
    robot: str | Path | None = None,
    *,
    validate: str | Path | Sequence[str | Path] = (),
    out: str | Path | None = None,
    **options: Unpack[ImportOptions],
) -> Recording | MotionRecording:
    """The recording in log files of any format that `armlab recording import` reads.

    robot: a built-in name or a robot file. validate: files that take no part in any fit. out: new folder for the
    recording; a temporary one, which goes with the Python process, if left out. The findings of the recording say what
    each signal was taken from, and what is doubtful. Raises InputError, in one line, for wrong options, and for all
    that are missing together.

    options, those of `armlab recording import`, are needed only where the files do not tell. Columns: time, position,
    torque, velocity, temperature, voltage, link_position, reference_position, reference_velocity, simulated_torque,
    simulated_position, each names or one text with commas and patterns. units: by signal, `{"position": "deg"}`. gains:
    N m per A or V, one a joint. gear_ratio: of signals of the motors, turns of the motor in one turn of the joint;
    motor_side: which those are, both if left out. joints: of the robot, in the order of the columns, for motion only.
    tip: the link where the arm ends. lock: positions, rad or m, of joints that stand still. repair: whether links that
    no body can be become the nearest bodies. separator, decimal: of a text file. topic, command_topic: of a bag.

        armlab.import_recording("log.csv", robot="arm.urdf", position="q*", torque="tau*", units={"torque": "N.m"})
    """
    given, held_out = _paths(files), _paths(validate)
    every = [*given, *(path for path in held_out if path not in given)]
    if not every:
        raise InputError("files is empty: give at least one log")
    return _import(every, robot, held_out, _place(out, f"{every[0].stem}-recording"), options, read_sources)


def recording_of_frames(
    frame: "pd.DataFrame | Sequence[pd.DataFrame] | Mapping[Any, pd.DataFrame]",
    robot: str | Path | None = None,
    *,
    validate: Any = None,
    out: str | Path | None = None,
    **options: Unpack[ImportOptions],
) -> Recording | MotionRecording:
    """See `Recording.from_dataframe`."""
    runs, held_out = _split_frames(frame, validate)
    sources = {f"{name}.csv": table for name, table in {**runs, **held_out}.items()}

    def read(path: Path, reading: ReadOptions) -> Mapping[str, Source]:
        found = table_of_frame(_with_index(sources[str(path)]), path)
        return {str(path): Source(found.table, dict.fromkeys(found.stamps, "s"), "DataFrame", stamps=found.stamps)}

    paths = [Path(name) for name in sources]
    validating = [Path(f"{name}.csv") for name in held_out]
    return _import(paths, robot, validating, _place(out, "recording"), options, read)


def _split_frames(frame: Any, validate: Any) -> tuple[dict[str, "pd.DataFrame"], dict[str, "pd.DataFrame"]]:
    """Frames by the names of their runs: those that identify, and those that validate."""
    import pandas as pd

    if validate is None:
        return _named_frames(frame, "run"), {}
    is_list = isinstance(validate, list | tuple) and all(isinstance(each, pd.DataFrame) for each in validate)
    if is_list or isinstance(validate, pd.DataFrame | Mapping):
        held_out = _named_frames(validate, "validate")
        runs = _named_frames(frame, "run")
        twice = sorted(set(runs) & set(held_out))
        if twice:
            raise InputError(f"run {twice[0]!r} is in frame and in validate: a run cannot both identify and validate")
        return runs, held_out
    marks = np.asarray(validate)
    if not isinstance(frame, pd.DataFrame) or marks.dtype != bool or marks.shape != (len(frame),):
        raise InputError(
            "validate should be a DataFrame, a list or a dictionary of them, or, for one frame, one True or False a row"
        )
    if marks.all() or not marks.any():
        found, right = ("every row", "leave rows to identify from") if marks.any() else ("no row", "or leave it out")
        raise InputError(f"validate holds {found} of the frame: mark those that take no part in any fit, {right}")
    starts = [0, *(np.flatnonzero(np.diff(marks)) + 1).tolist(), len(marks)]
    parts = [(bool(marks[first]), frame.iloc[first:last]) for first, last in pairwise(starts)]
    shortest = min(len(part) for _, part in parts)
    if shortest < MIN_PART_SAMPLES:
        raise InputError(
            f"validate cuts the frame into {len(parts)} stretches, the shortest of {shortest} rows: mark whole "
            f"stretches of time, each of {MIN_PART_SAMPLES} rows or more"
        )
    runs = {f"run-{number}": part for number, (is_held_out, part) in enumerate(parts, 1) if not is_held_out}
    return runs, {f"validate-{number}": part for number, (is_held_out, part) in enumerate(parts, 1) if is_held_out}


def _named_frames(frames: Any, stem: str) -> dict[str, "pd.DataFrame"]:
    import pandas as pd

    if isinstance(frames, str | pd.DataFrame | pd.Series | np.ndarray) or not isinstance(frames, Iterable):
        frames = [frames]
    named = frames if isinstance(frames, Mapping) else {f"{stem}-{k}": each for k, each in enumerate(frames, 1)}
    wrong = next((each for each in named.values() if not isinstance(each, pd.DataFrame)), None)
    if wrong is not None or not named:
        found = "nothing" if wrong is None else type(wrong).__name__
        raise InputError(f"a recording is made of DataFrames, one a run, not of {found}{_instead_of(wrong)}")
    return {re.sub(r"[^\w.-]+", "_", str(name)): each for name, each in named.items()}


def _instead_of(wrong: object) -> str:
    """What would be right where a path or an array was given for a frame."""
    if isinstance(wrong, str | Path):
        return ": armlab.import_recording takes the path of a log"
    return ": give pd.DataFrame(x, columns=[...])" if isinstance(wrong, np.ndarray) else ""


def _with_index(frame: "pd.DataFrame") -> "pd.DataFrame":
    """The frame with its index as a column, where that is no bare count of the rows: often it is the time."""
    import pandas as pd

    if isinstance(frame.index, pd.RangeIndex) or (frame.index.name is None and frame.index.dtype.kind == "i"):
        return frame.reset_index(drop=True)
    return frame.reset_index(names=frame.index.name or "time") if frame.index.nlevels == 1 else frame.reset_index()


def _paths(given: Any) -> list[Path]:
    if isinstance(given, str | Path):
        return [Path(given)]
    entries = given if isinstance(given, Sequence) else [given]
    wrong = next((each for each in entries if not isinstance(each, str | Path)), None)
    if wrong is not None:
        raise InputError(
            f"files and validate should be paths of logs, not {type(wrong).__name__}: armlab.Recording.from_dataframe "
            "takes DataFrames"
        )
    return [Path(each) for each in entries]


def _import(
    files: Sequence[Path],
    robot: Any,
    validate: Sequence[Path],
    place: Place,
    options: ImportOptions,
    read: ReadSources,
) -> Recording | MotionRecording:
    """The flow of the command's import."""
    if not isinstance(robot, str | Path | None):
        raise InputError(
            f"robot should be a built-in name or the path of a robot file, which a recording keeps, not "
            f"{type(robot).__name__}"
        )
    changes = [name for name in ("tip", "lock", "repair") if options.get(name)]
    if place.is_temporary and changes:
        raise InputError(f"{changes[0]} makes a robot file of its own: give out, a new folder that keeps it")
    source = None if robot is None else str(robot)
    given = {"robot": source, "validate": tuple(validate), "out": place.folder, **_as_texts(dict(options))}
    with _keywords_for_flags():
        imported = write_plan(plan_import(files, given, read))
    doubts = [Finding("import_doubt", "warning", _in_keywords(text)) for text in imported.plan.doubts]
    rows = [(name, text) for name, text in describe_plan(imported.plan) if name != "doubtful"]
    notes = [Finding("imported", "note", f"{name}: {_in_keywords(text)}") for name, text in rows]
    recording = read_recording(imported.folder)
    if place.is_temporary and recording.robot not in built_in_arms():  # a model outlives the copy in the folder
        recording = replace(recording, robot=str(Path(str(source)).resolve()))
    return replace(recording, findings=(*recording.findings, *doubts, *notes))


def _place(out: str | Path | None, name: str) -> Place:
    """The folder that is wanted, or one of that name that is there until Python ends."""
    if out is not None:
        return Place(Path(out), is_temporary=False)
    above = Path(mkdtemp(prefix="armlab-"))
    atexit.register(shutil.rmtree, above, ignore_errors=True)
    return Place(above / name, is_temporary=True)


_NO_TEXT: dict[str, Any] = {"units": (), "lock": (), "repair": False}


def _as_texts(options: dict[str, Any]) -> dict[str, Any]:
    """The options as the command has them; all others are None. Raises InputError for one that there is not."""
    known = list(ImportOptions.__annotations__)
    for name in options:
        if name not in known:
            raise InputError(f"unknown option '{name}': {suggest_name(name, [*known, 'robot', 'validate', 'out'])}")
    texts: dict[str, Any] = {**dict.fromkeys(known), **_NO_TEXT}
    for name, value in options.items():
        if name in ("units", "lock"):
            if not isinstance(value, Mapping):
                raise InputError(f"{name} should be a dictionary like {_EXAMPLES[name]}, not {value!r}")
            texts[name] = tuple(f"{key}={each}" for key, each in value.items())
        else:
            texts[name] = value if value is None or isinstance(value, str | bool) else _joined(name, value)
    return texts


_EXAMPLES = {"units": "{'position': 'deg'}", "lock": "{'finger_joint': 0.02}"}


def _joined(name: str, value: Any) -> str:
    """Several names or numbers as one text with commas between them."""
    parts = [str(each) for each in value] if isinstance(value, Sequence | np.ndarray) else [str(value)]
    with_comma = next((part for part in parts if "," in part), None)
    if with_comma is not None:
        raise InputError(f"{name}: the name {with_comma!r} holds a comma: rename this column")
    return ",".join(parts)


@contextmanager
def _keywords_for_flags() -> Iterator[None]:
    """Messages that name options of the command name the keywords instead."""
    try:
        yield
    except InputError as error:
        raise InputError(_in_keywords(str(error))) from None


_REWORDED: tuple[tuple[str, str | Callable[[re.Match[str]], str]], ...] = (
    (r"--unit (\w+)=([\w./]+)", r"units={'\1': '\2'}"),
    (r"--lock ([\w./-]+)=([\w.]+)", r"lock={'\1': \2}"),
    (r"--unit\b", "units="),
    (r"--([a-z]+(?:-[a-z]+)*)", lambda found: f"{found[1].replace('-', '_')}="),
)


def _in_keywords(text: str) -> str:
    for pattern, words in _REWORDED:
        text = re.sub(pattern, words, text)
    return text
