"""A result set as a folder of tidy tables that anyone can read, and back."""

import json
from collections.abc import Callable, Iterable, Iterator
from io import BytesIO
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from bench.files import write_whole
from bench.sharing.result_set import TRIAL, ResultSet, TableOfCurves
from problem.errors import InputError

SETTINGS, ORIGINS, TABLES = "settings.yaml", "origins.json", ("trials", "curves")
_READ_ME = """\
# {name}: results as tidy tables

`trials`: one row a trial. problem, swarm_size, budget (evaluations), algorithm, repetition: which; those with the same
repetition began with the same first population. value: the problem's own figure of the best point, for an arm the
condition number, without weights and penalty. violation: 0 where every limit is kept. fitness: what was minimised.
evaluations: used. seconds: of processor time. dimension: numbers that were searched.

`curves`: one row a trial and population. evaluations: used so far. value, violation: of the best point so far.

`{settings}`: everything that was set. `{origins}`: versions, processor and commit of every machine that took part.
"""


def write_tidy(results: ResultSet, folder: Path, form: str) -> list[Path]:
    """Write a result set into a folder, its tables as `csv` or `parquet`; returns the files."""
    tables = {"trials": iter([results.trials]), "curves": (curves for _, _, curves in results.cells())}
    files: dict[str, str | bytes | Iterable[bytes]] = {
        f"{name}.{form}": _WRITERS[form](tables[name]) for name in TABLES
    }
    files |= {
        ORIGINS: json.dumps(results.origins, indent=1) + "\n",
        "README.md": _READ_ME.format(name=results.name, settings=SETTINGS, origins=ORIGINS),
        SETTINGS: results.settings,
    }
    make_folder(folder)
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]


def read_tidy(folder: Path) -> ResultSet:
    """The result set in a folder that `write_tidy` made; raises InputError, in one line, if it is none."""
    try:
        settings = (folder / SETTINGS).read_text()
        origins = json.loads((folder / ORIGINS).read_text())
        name = str(yaml.safe_load(settings)["name"])
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise InputError(f"{folder} is no folder of results: {error!s}".splitlines()[0]) from None
    trials, curves = (_read(folder, table) for table in TABLES)
    return ResultSet(name, settings, tuple(origins), trials, TableOfCurves(curves))


def _read(folder: Path, name: str) -> pd.DataFrame:
    for form, reader in _READERS.items():
        path = folder / f"{name}.{form}"
        if path.exists():
            return _checked(reader, path)
    raise InputError(f"{folder} is no folder of results: it holds neither {name}.csv nor {name}.parquet")


def _checked(reader: Callable[[Path], pd.DataFrame], path: Path) -> pd.DataFrame:
    try:
        table = reader(path)
    except (OSError, ValueError) as error:  # of pandas and pyarrow alike
        raise InputError(f"cannot read {path}: {error!s}".splitlines()[0]) from None
    missing = [column for column in [*TRIAL, "evaluations", "value", "violation"] if column not in table]
    if missing:
        raise InputError(f"{path} lacks the columns {', '.join(missing)}")
    return table


def make_folder(folder: Path) -> None:
    """Make a folder for results; raises InputError if that is not possible."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror}") from None


def _as_csv(pieces: Iterator[pd.DataFrame]) -> Iterator[bytes]:
    for place, piece in enumerate(pieces):  # every digit, so that nothing changes on the way
        yield piece.to_csv(index=False, header=place == 0, lineterminator="\n").encode()


def _as_parquet(pieces: Iterator[pd.DataFrame]) -> bytes:
    """A row group a piece; compressed, the whole is small enough for the memory."""
    try:
        from pyarrow import Table
        from pyarrow.parquet import ParquetWriter
    except ImportError:
        raise InputError("Parquet needs the package `pyarrow`: install it, or write CSV") from None
    first = Table.from_pandas(next(pieces), preserve_index=False)
    buffer = BytesIO()
    with ParquetWriter(buffer, first.schema) as writer:
        writer.write_table(first)
        for piece in pieces:
            writer.write_table(Table.from_pandas(piece, schema=first.schema, preserve_index=False))
    return buffer.getvalue()


_WRITERS: dict[str, Callable[[Iterator[pd.DataFrame]], Any]] = {"csv": _as_csv, "parquet": _as_parquet}
_READERS: dict[str, Callable[[Path], pd.DataFrame]] = {"csv": pd.read_csv, "parquet": pd.read_parquet}
