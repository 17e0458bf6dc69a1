"""The content of the files to import, whatever their format: columns, the units that a file names, its conventions."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from armlab.common.errors import InputError
from armlab.recordings.imports.frames import read_json, read_json_lines, read_npz, read_parquet
from armlab.recordings.imports.lerobot import (
    COMMAND,
    PERCENT_NAMES,
    STAMP,
    STATE,
    dataset_of,
    is_lerobot,
    read_lerobot,
)
from armlab.recordings.imports.matlab import read_mat
from armlab.recordings.imports.packed import PACKED_SUFFIXES, unpacked
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.table import Table
from armlab.recordings.text_rows import Progress, silent

BAG_SUFFIXES = (".db3", ".mcap", ".bag")
TEXT_SUFFIXES = (".csv", ".txt", ".dat", ".tsv", ".log", ".asc")
BAG_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "N.m", "command": "rad"}
BAG_PREFIXES = {"position": "position_", "reference_position": "command_"}
FRAME_READERS = {
    ".parquet": read_parquet,
    ".json": read_json,
    ".jsonl": read_json_lines,
    ".ndjson": read_json_lines,
}
LEROBOT_PREFIXES = {"position": f"{STATE}.", "reference_position": f"{COMMAND}."}


@dataclass(frozen=True)
class ReadOptions:
    """How to read a file, where the file does not tell: layout of a text; topics of a bag, and the robot's joints."""

    separator: str | None = None
    decimal: str | None = None
    topic: str | None = None
    commands: str | None = None
    joints: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Source:
    """Content of a file: its columns, the units that it names, and a line on how it was read.

    prefixes: of positions and commands whose columns end with the names of joints, by the signal. not_angles: joints
    whose numbers are neither angles nor lengths. same_units: signals that have the unit of another one, by the format.
    stamps: how columns of text that are stamps are written, by name. reason: why the units are these.
    """

    table: Table
    units: dict[str, str]
    note: str
    prefixes: Mapping[str, str] = field(default_factory=dict)
    not_angles: tuple[str, ...] = ()
    same_units: Mapping[str, str] = field(default_factory=dict)
    stamps: Mapping[str, str] = field(default_factory=dict)
    reason: str = "the file names it"

    @property
    def has_commands(self) -> bool:
        """Whether the format itself says which columns are commands."""
        prefix = self.prefixes.get("reference_position")
        return prefix is not None and any(name.startswith(prefix) for name in self.table.names)

    def joints_of(self, signal: str) -> tuple[str, ...]:
        """The joints of a signal's columns, in the order of the file; for a source with prefixes."""
        prefix = self.prefixes[signal]
        return tuple(name.removeprefix(prefix) for name in self.table.names if name.startswith(prefix))


def read_sources(path: Path, options: ReadOptions, progress: Progress = silent) -> dict[str, Source]:
    """The content of a path by the paths of its runs: several for a LeRobot dataset, which holds episodes.

    progress: is told how far the reading of a large file is.
    Raises InputError for an unknown format and a broken file, and UndecidedError where an option has to choose.
    """
    dataset = dataset_of(path) if path.suffix.lower() == ".parquet" else None
    if dataset is None and not is_lerobot(path):
        return {str(path): _read_source(path, options, progress)}
    found = read_lerobot(path) if dataset is None else read_lerobot(dataset, path)
    return {
        str(path / name): Source(
            table=table,
            units={STAMP: "s"},
            note=f"LeRobot episode; {COMMAND} is the command, {STATE} the position",
            prefixes=LEROBOT_PREFIXES,
            not_angles=PERCENT_NAMES,
            same_units={"reference_position": "position"},
            reason="as in LeRobot datasets",
        )
        for name, table in found.items()
    }


def _read_source(path: Path, options: ReadOptions, progress: Progress) -> Source:
    if not path.exists():
        raise InputError(f"no file {path}")
    suffix = path.suffix.lower()
    if suffix in PACKED_SUFFIXES:
        with unpacked(path) as inside:
            return _read_source(inside, options, progress)
    if suffix in BAG_SUFFIXES or path.is_dir():
        table = read_bag(path, options.topic, options.commands, options.joints, progress)
        note = "joint states; rad, rad/s and N.m by ROS convention"
        return Source(table, _bag_units(table), note, BAG_PREFIXES, reason="as in ROS messages")
    if suffix == ".mat":
        return Source(read_mat(path), {}, "MATLAB variables")
    if suffix in FRAME_READERS:
        frame = FRAME_READERS[suffix](path)
        read = "".join(f"; {name} is {words}, from the first row" for name, words in frame.stamps.items())
        return Source(frame.table, dict.fromkeys(frame.stamps, "s"), f"{suffix} columns{read}", stamps=frame.stamps)
    if suffix == ".npz":
        return Source(read_npz(path), {}, "NumPy arrays")
    if suffix in TEXT_SUFFIXES:
        text = read_odd_csv(path, options.separator, options.decimal, progress)
        read = "".join(f"; {name} is {words}, from the first row" for name, words in text.stamps.items())
        return Source(text.table, text.units, f"{text.layout}{read}", stamps=text.stamps, reason="from the header")
    known = ", ".join((".mat", ".npz", *FRAME_READERS, *BAG_SUFFIXES, *TEXT_SUFFIXES))
    packed = ", ".join(PACKED_SUFFIXES)
    raise InputError(
        f"cannot import {path}: its ending should be one of {known}, packed ({packed}) or not, or it should be a bag's "
        "folder"
    )


def _bag_units(table: Table) -> dict[str, str]:
    units = {name: BAG_UNITS[name.split("_")[0]] for name in table.names if name.split("_")[0] in BAG_UNITS}
    return {"t": "s", **units}
