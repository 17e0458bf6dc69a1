"""Reads a file of any known format as a table."""

from dataclasses import dataclass
from pathlib import Path

from problem.errors import InputError
from recordings.imports.matlab import read_mat
from recordings.imports.ros import read_bag
from recordings.imports.text import read_odd_csv
from recordings.table import Table, read_table

BAGS = (".db3", ".mcap", ".bag")
TEXTS = (".csv", ".txt", ".dat", ".tsv", ".log", ".asc")
BAG_UNITS = {"position": "rad", "velocity": "rad/s", "effort": "N.m"}


@dataclass(frozen=True)
class ReadOptions:
    """What a person may have to say about a file: layout of a text, topic of a bag."""

    separator: str | None = None
    decimal: str | None = None
    topic: str | None = None


@dataclass(frozen=True, eq=False)
class Source:
    """What a file holds: its columns, units where it names some, and a line on how it was read."""

    table: Table
    units: dict[str, str]
    note: str


def read_source(path: Path, options: ReadOptions) -> Source:
    """The columns of a file, whatever its format; InputError for an unknown one and a broken file."""
    if not path.exists():
        raise InputError(f"no file {path}")
    suffix = path.suffix.lower()
    if suffix in BAGS or path.is_dir():
        table = read_bag(path, options.topic)
        return Source(table, _bag_units(table), "joint states; positions rad, efforts N.m by ROS convention")
    if suffix == ".mat":
        return Source(read_mat(path), {}, "MATLAB variables")
    if suffix == ".parquet":
        return Source(read_table(path), {}, "Parquet columns")
    if suffix in TEXTS:
        text = read_odd_csv(path, options.separator, options.decimal)
        return Source(text.table, text.units, str(text.layout))
    known = ", ".join((".mat", ".parquet", *BAGS, *TEXTS))
    raise InputError(f"cannot import {path}: its ending should be one of {known}, or it should be a bag's folder")


def _bag_units(table: Table) -> dict[str, str]:
    units = {name: BAG_UNITS[name.split("_")[0]] for name in table.names if name.split("_")[0] in BAG_UNITS}
    return {"t": "s", **units}
