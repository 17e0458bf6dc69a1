"""What an import knows and what it has to ask: files, options and robot together, before anything is written.

A plan is made anew with each answer: an answer is an option, as if it had been given with the command.
"""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from armlab.common.documents import Document
from armlab.common.errors import InputError, UndecidedError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.columns import Log, choose_columns, choose_commands
from armlab.recordings.imports.controllers import ask_controller, read_controller
from armlab.recordings.imports.doubtful import doubtful_units
from armlab.recordings.imports.gears import Gear, choose_gear
from armlab.recordings.imports.impossible import ask_impossible_units
from armlab.recordings.imports.numbers import read_numbers
from armlab.recordings.imports.proposals import propose_robot
from armlab.recordings.imports.questions import Options, Question
from armlab.recordings.imports.rates import put_on_common_stamps
from armlab.recordings.imports.robots import ImportedRobot, read_robot
from armlab.recordings.imports.scales import choose_gains, choose_units
from armlab.recordings.imports.sources import ReadOptions, Source, read_sources
from armlab.recordings.imports.time_columns import JOINED, join_columns
from armlab.recordings.recording_file import check_new_folder
from armlab.recordings.units import SENSOR_SIGNALS, TIME_UNITS
from problem.robot_file import built_in_arms

SEPARATOR_WORDS = {"tab": "\t", "blank": " ", "space": " ", "comma": ",", "semicolon": ";"}
ReadSources = Callable[[Path, ReadOptions], Mapping[str, Source]]


@dataclass(frozen=True, eq=False)
class ImportPlan:
    """A recording to be written once no question is open.

    options: as they were given. robot: None while it is open. sources: by the path of the run. columns: names by the
    signal. units: of each signal, one for all its columns or one a column. column_reasons, unit_reasons: why these, by
    the signal. gains: of the torque, where it is in A or V. gear: of signals that were measured at the motors. joints:
    of the robot, in the order of the columns, where the recording has only some of them. controller:
    the drive of a log of commands and positions, where the options state it. doubts: what is probably, but
    not surely, read in a wrong unit. unused: columns of the first file that hold numbers and are no signal.
    """

    options: Options
    robot: ImportedRobot | None
    sources: Mapping[str, Source] = field(default_factory=dict)
    columns: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    units: Mapping[str, str | tuple[str, ...]] = field(default_factory=dict)
    column_reasons: Mapping[str, str] = field(default_factory=dict)
    unit_reasons: Mapping[str, str] = field(default_factory=dict)
    gains: tuple[float, ...] | None = None
    gear: Gear | None = None
    joints: tuple[str, ...] = ()
    controller: Document | None = None
    doubts: tuple[str, ...] = ()
    unused: tuple[str, ...] = ()
    questions: tuple[Question, ...] = ()

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints that the columns belong to; empty while the robot is open."""
        arm = self.robot.arm if self.robot else None
        return self.joints or (tuple(joint.name for joint in arm.joints) if arm else ())


def plan_import(files: Sequence[Path], options: Options, read: ReadSources = read_sources) -> ImportPlan:
    """What is known of an import, and the questions that are open.

    options: out, robot, tip, lock, the columns of each signal, units, gains, gear_ratio, motor_side, joints,
    controller, validate, separator, decimal, topic, command_topic. read: reads a file; a form that plans after each
    answer gives one that keeps what it read. Raises InputError for an option that cannot be right, whatever the
    answers to the questions are.
    """
    robot, undecided = _read_robot(options)
    arm = robot.arm if robot else None
    whole = tuple(joint.name for joint in arm.joints) if arm else ()
    chosen = _choose_joints(options.get("joints"), whole)
    if options.get("out") is not None:
        check_new_folder(Path(options["out"]))
    try:
        sources = _read_files(files, options, chosen or whole, read)
    except UndecidedError as error:
        robots = () if robot else (undecided or _ask_robot(files[0], None, ()),)
        return ImportPlan(options, robot, questions=(*robots, _ask_choice(error), *_ask_out(files, options)))
    _check_validate(options["validate"], sources)
    log = Log(next(iter(sources.values())), options, arm, chosen or whole)
    log, commands, unmatched = choose_commands(log)
    chosen_columns, unnamed = choose_columns(log, commands, unmatched)
    columns = {signal: known.value for signal, known in chosen_columns.items()}
    taken = {name for names in columns.values() for name in names} | {JOINED}
    if len(columns.get("time", ())) == 2:
        sources = {path: _join_time(source, columns["time"]) for path, source in sources.items()}
        log, columns = replace(log, source=next(iter(sources.values()))), {**columns, "time": (JOINED,)}
    _check_sources(sources, columns)
    _check_order(columns)
    count = len(columns["position"]) if "position" in columns else None
    gear = choose_gear(options, columns, has_all_columns=not unnamed)
    chosen_units, unmeasured = choose_units(log, columns, gear)
    units = {name: known.value[0] if len(known.value) == 1 else known.value for name, known in chosen_units.items()}
    if not unnamed and not unmatched and "time" in units:
        factor = TIME_UNITS[str(units["time"])].factor
        sources = {
            path: replace(source, table=put_on_common_stamps(source.table, columns, factor))
            for path, source in sources.items()
        }
        log = replace(log, source=next(iter(sources.values())))
    gains, unscaled = choose_gains(options.get("gains"), columns, units)
    numbers = read_numbers(log, sources, columns, units, gear)
    impossible = ask_impossible_units(numbers, units, gains, log.source.same_units)
    doubts = () if impossible or unscaled else doubtful_units(numbers, arm, units, gains, gear)
    robots = () if robot else (undecided or _ask_robot(files[0], count, log.joints),)
    is_motion = "reference_position" in columns and "torque" not in columns
    if options.get("controller") and not is_motion:
        raise InputError("--controller belongs to a log of commands and positions, without --torque")
    is_asked = is_motion and not options.get("controller") and not unnamed and not unmatched
    return ImportPlan(
        options=options,
        robot=robot,
        sources=sources,
        columns=columns,
        units=units,
        column_reasons={signal: known.reason for signal, known in chosen_columns.items()},
        unit_reasons={signal: known.reason for signal, known in chosen_units.items()},
        gains=gains,
        gear=gear,
        doubts=(*doubts, *(robot.impossible if robot else ())),
        joints=log.joints if arm and (log.joints != whole or chosen) else (),
        unused=tuple(name for name in log.source.table.filled if name not in taken),
        controller=read_controller(options.get("controller"), log.joints),
        questions=(
            *robots,
            *unmatched,
            *unnamed,
            *unmeasured,
            *unscaled,
            *impossible,
            *(ask_controller(robot, log.joints) if is_asked else ()),
            *_ask_out(files, options),
        ),
    )


def _join_time(source: Source, names: tuple[str, ...]) -> Source:
    """The source with its time in one column."""
    table = join_columns(source.table, names, source.units.get(names[1]))
    return replace(source, table=table, units={**source.units, JOINED: "s"})


def _read_robot(options: Options) -> tuple[ImportedRobot | None, Question | None]:
    """The robot, or the question where its arm ends."""
    try:
        return read_robot(options), None
    except UndecidedError as error:
        return None, _ask_choice(error)


def _choose_joints(given: str | None, whole: tuple[str, ...]) -> tuple[str, ...]:
    chosen = tuple(part.strip() for part in given.split(",")) if given else ()
    for name in chosen:
        if whole and name not in whole:
            raise InputError(f"--joints names '{name}', which the robot does not have: {suggest_name(name, whole)}")
    return chosen


def _read_files(
    files: Sequence[Path], options: Options, joints: tuple[str, ...], read: ReadSources
) -> dict[str, Source]:
    separator = options["separator"]
    reading = ReadOptions(
        separator=SEPARATOR_WORDS.get(separator, separator),
        decimal=options["decimal"],
        topic=options["topic"],
        commands=options.get("command_topic"),
        joints=joints,
    )
    sources: dict[str, Source] = {}
    for path in files:
        for name, source in read(path, reading).items():
            if name in sources:
                raise InputError(f"{name} is given twice: a run cannot both identify and validate")
            sources[name] = source
    return sources


def _check_validate(validate: Sequence[Path], sources: Mapping[str, Source]) -> None:
    unknown = sorted({str(path) for path in validate} - set(sources))
    if unknown:
        raise InputError(f"--validate {unknown[0]} should be one of the imported files")
    if sources and len({str(path) for path in validate}) == len(sources):
        raise InputError("--validate names every imported file: leave one or more to identify")


def _check_sources(sources: Mapping[str, Source], columns: Mapping[str, tuple[str, ...]]) -> None:
    """Raises InputError for a file that lacks a column or numbers in it, or names another unit than the first file."""
    first_path, first = next(iter(sources.items()))
    for path, source in sources.items():
        for signal, names in columns.items():
            source.table.columns(names, signal)
            hollow = [name for name in names if name in source.table.empty]
            if hollow:
                raise InputError(f"{path}: column {', '.join(hollow)} ({signal}) is empty: it has no number in any row")
            for name in names:
                unit, other = first.units.get(name), source.units.get(name)
                if unit != other:
                    raise InputError(
                        f"{name} is in {other or 'no unit'} in {path}, in {unit or 'no unit'} in {first_path}: "
                        "import files of one kind together"
                    )


def _check_order(columns: Mapping[str, tuple[str, ...]]) -> None:
    """Raises InputError for columns of joints whose numbers stand in another order than those of the position."""
    position = _numbers_of(columns.get("position", ()))
    for signal, names in columns.items():
        own = [] if signal in SENSOR_SIGNALS else _numbers_of(names)
        if own and own != position and sorted(own) == sorted(position):
            raise InputError(
                f"{signal.replace('_', ' ')} has the columns {', '.join(names)}, position has "
                f"{', '.join(columns['position'])}: the columns of a joint should stand at one place in both"
            )


def _numbers_of(names: Sequence[str]) -> list[int]:
    """The last number in each name; none where a name has no number or two have the same."""
    found = [re.findall(r"\d+", name) for name in names]
    numbers = [int(each[-1]) for each in found if each]
    return numbers if len(set(numbers)) == len(names) else []


def _ask_robot(log: Path, count: int | None, joints: tuple[str, ...]) -> Question:
    known = ", ".join(built_in_arms())
    missing = f"the robot is missing: give --robot with one of {known}, or with the path of a robot file"
    return Question("robot", missing, f"robot: a file, or one of {known}", propose_robot(log, count, joints))


def _ask_choice(error: UndecidedError) -> Question:
    return Question(error.option, str(error), f"{error.option}: one of {', '.join(error.choices)}", error.choices[0])


def _ask_out(files: Sequence[Path], options: Options) -> tuple[Question, ...]:
    if options.get("out") is not None:
        return ()
    name = f"{files[0].resolve().stem}-recording"
    return (Question("out", "the folder to write is missing: give --out FOLDER", "new folder for the recording", name),)
