"""Result sets as files: tidy tables (CSV, Parquet), read and written, and the format of IOHprofiler, written.

IOHprofiler (Doerr 2018, arXiv 1810.05281; read by IOHanalyzer and iohinspector) has a folder for each algorithm; in it
are a problem's JSON file and its table of evaluations and best values. The format has no number for an infeasible best:
the largest double stands for it. Readers recognise a run by its row at evaluation 1, but only whole populations are
stored: that row has the largest double too.
"""

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from io import BytesIO
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import pandas as pd
import yaml

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.files import all_or_none, write_whole
from armlab.common.packages import MissingPackageError
from armlab.common.report.printed_table import TABLE_FORMS
from bench.config import NAME_PATTERN
from bench.files import file_name
from bench.result_sets.result_set import (
    TRIAL_COLUMNS,
    ResultSet,
    TableOfCurves,
    read_stored_results,
    runs_by_algorithm,
)
from bench.statistics.performance import Run
from bench.tables import summary_for_print, summary_table

SETTINGS, ORIGINS, TABLES = "settings.yaml", "origins.json", ("trials", "curves")
_README_TEXT = """\
# {name}: results as tidy tables

`trials`: one row a trial. problem, swarm_size, budget (evaluations), algorithm, repetition: which; those with the same
repetition began with the same first population. value: the problem's own figure of the best point, for an arm the
condition number, without weights and penalty. violation: 0 where every limit is kept. fitness: what was minimised.
evaluations: used. seconds: of processor time. dimension: numbers that were searched. failure: why a trial ended without
an outcome, empty for all others; it counts as infeasible.

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
        "README.md": _README_TEXT.format(name=results.name, settings=SETTINGS, origins=ORIGINS),
        SETTINGS: results.settings,
    }
    _check_shared_folder(folder, results, files)
    for name in TABLES:
        for other in _WRITERS.keys() - {form}:  # a reader would not know which table counts
            (folder / f"{name}.{other}").unlink(missing_ok=True)
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]


def _check_shared_folder(folder: Path, results: ResultSet, names: Iterable[str]) -> None:
    """Makes the folder; raises InputError where files of others would be replaced."""
    make_folder(folder)
    try:
        if (folder / SETTINGS).read_text() == results.settings:
            return
    except (OSError, ValueError):
        pass
    tables = [f"{name}.{form}" for name in TABLES for form in _WRITERS]
    there = sorted(name for name in {*names, *tables} if (folder / name).exists())
    if there:
        raise InputError(f"{folder} holds {there[0]}, which is not of these results: choose another folder with --out")


def read_tidy(folder: Path) -> ResultSet:
    """The result set in a folder that `write_tidy` wrote; raises InputError, in one line, if it is none."""
    try:
        settings = (folder / SETTINGS).read_text()
        origins = _check_origins(json.loads((folder / ORIGINS).read_text()))
        name = _check_settings(yaml.safe_load(settings))
    except (OSError, ValueError, KeyError, TypeError, yaml.YAMLError) as error:
        raise InputError(f"{folder} is no folder of results: {error!s}".splitlines()[0]) from None
    trials_file, curves_file = (_table_file(folder, table) for table in TABLES)
    trials, curves = _read_table(trials_file, []), _read_table(curves_file, ["evaluations"])
    reasons = trials.get("failure", pd.Series("", trials.index))  # tables of older releases have none
    trials["failure"] = reasons.astype("str").fillna("")
    _check_same_trials(trials, curves, trials_file, curves_file)
    return ResultSet(name, settings, origins, trials, TableOfCurves(curves))


def _check_origins(origins: Any) -> tuple[dict[str, Any], ...]:
    """The machines that took part; raises ValueError where they are not as `bench share` writes them."""
    if not isinstance(origins, list) or not all(isinstance(each, dict) for each in origins):
        raise ValueError(f"{ORIGINS} should be a list with a mapping for each machine")
    return tuple(origins)


def _check_settings(settings: Any) -> str:
    """The name of the results; raises ValueError where settings are not as `bench share` writes them."""
    wanted = {"name": str, "seed": int, "problem": dict, "algorithms": dict}
    for key, kind in wanted.items():
        if not isinstance(settings, dict) or not isinstance(settings.get(key), kind):
            raise ValueError(f"{SETTINGS} should have `{key}`, {_KINDS[kind]}")
    if not re.fullmatch(NAME_PATTERN, settings["name"]):
        raise ValueError(f"{SETTINGS}: `name` should be 1 to 100 letters, digits, - and _, a letter or digit first")
    for label, entry in settings["algorithms"].items():
        if not isinstance(entry, dict) or not isinstance(entry.get("name"), str):
            raise ValueError(f"{SETTINGS}, algorithms, {str(label)[:40]}: should have `name`, a text")
    return str(settings["name"])


_KINDS = {str: "a text", int: "a whole number", dict: "a mapping"}


def _table_file(folder: Path, name: str) -> Path:
    for form in _READERS:
        path = folder / f"{name}.{form}"
        if path.exists():
            return path
    raise InputError(f"{folder} is no folder of results: it holds neither {name}.csv nor {name}.parquet")


def _read_table(path: Path, also_key: Sequence[str]) -> pd.DataFrame:
    """A table whose columns hold what they should. also_key: what tells its rows apart beside the trial."""
    try:
        table = _READERS[path.suffix.removeprefix(".")](path)
    except (OSError, ValueError) as error:  # of pandas and pyarrow alike
        raise InputError(f"cannot read {path}: {error!s}".splitlines()[0]) from None
    missing = [column for column in [*TRIAL_COLUMNS, *_LEAST, "value"] if column not in table]
    if missing:
        raise InputError(f"{path} lacks the columns {', '.join(missing)}")
    if table.empty:
        raise InputError(f"{path} has no rows: share the results again")
    for column in ("problem", "algorithm"):
        _check_cells(table[column].notna() & (table[column] != ""), table, column, path, "a name")
    for column in ("value", *_LEAST):
        unit = "whole number" if column in _COUNTED else "number"
        numbers = pd.to_numeric(table[column], errors="coerce")
        right = numbers.notna() & (numbers >= _LEAST.get(column, 0))
        if column in _COUNTED:
            right &= numbers % 1 == 0
        if column == "value":  # a problem may have none at a point
            right |= table[column].isna()
        _check_cells(right, table, column, path, f"a {unit} of {_LEAST.get(column, 0)} or more")
        table[column] = numbers
    repeated = table.duplicated([*TRIAL_COLUMNS, *also_key])
    if repeated.any():
        raise InputError(f"{path}, row {int(repeated.to_numpy().argmax()) + 1}: the same trial stands above it")
    return table


_LEAST = {"swarm_size": 1, "budget": 1, "repetition": 0, "evaluations": 0, "violation": 0}
_COUNTED = _LEAST.keys() - {"violation"}


def _check_cells(right: "pd.Series[bool]", table: pd.DataFrame, column: str, path: Path, wanted: str) -> None:
    if not right.all():
        row = int(np.argmin(right.to_numpy()))
        raise InputError(
            f"{path}, row {row + 1}: {column} is {str(table[column].iloc[row])[:40]!r}, should be {wanted}"
        )


def _check_same_trials(trials: pd.DataFrame, curves: pd.DataFrame, trials_file: Path, curves_file: Path) -> None:
    finished = trials[trials["failure"] == ""]
    one, other = (set(map(tuple, table[TRIAL_COLUMNS].drop_duplicates().to_numpy())) for table in (finished, curves))
    if one != other:
        example = ", ".join(map(str, min(one ^ other, key=str)))
        raise InputError(f"{trials_file} and {curves_file} are not of the same trials: only one of them has {example}")


def make_folder(folder: Path) -> None:
    """Make a folder for results; raises InputError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"cannot make the folder {folder}: {error.strerror}") from None


def _to_csv(pieces: Iterator[pd.DataFrame]) -> Iterator[bytes]:
    for place, piece in enumerate(pieces):  # every digit, so that nothing changes on the way
        yield piece.to_csv(index=False, header=place == 0, lineterminator="\n").encode()


def _to_parquet(pieces: Iterator[pd.DataFrame]) -> bytes:
    """Parquet bytes with one row group a piece; the compressed table fits into memory."""
    try:
        from pyarrow import Table
        from pyarrow.parquet import ParquetWriter
    except ImportError:
        raise MissingPackageError("pyarrow", "Parquet") from None
    first = Table.from_pandas(next(pieces), preserve_index=False)
    buffer = BytesIO()
    with ParquetWriter(buffer, first.schema) as writer:
        writer.write_table(first)
        for piece in pieces:
            writer.write_table(Table.from_pandas(piece, schema=first.schema, preserve_index=False))
    return buffer.getvalue()


_WRITERS: dict[str, Callable[[Iterator[pd.DataFrame]], Any]] = {"csv": _to_csv, "parquet": _to_parquet}


def _from_csv(path: Path) -> pd.DataFrame:
    return pd.read_csv(path, converters=dict.fromkeys(("problem", "algorithm"), str))  # `1` and `none` are names, too


def _from_parquet(path: Path) -> pd.DataFrame:
    try:
        return pd.read_parquet(path)
    except ImportError:
        raise MissingPackageError("pyarrow", f"{path}: Parquet") from None


_READERS: dict[str, Callable[[Path], pd.DataFrame]] = {"csv": _from_csv, "parquet": _from_parquet}


def write_summary(results: ResultSet, folder: Path, form: str) -> list[Path]:
    """Write the summary of a result set into a folder as a table, `latex`, `pdf` or `svg`; returns the file."""
    suffix, write = TABLE_FORMS[form]
    path = folder / f"{results.name}.{suffix}"
    make_folder(folder)
    write_whole(path, write(summary_for_print(summary_table(results.trials))))
    return [path]


NOTHING_KNOWN = float(np.finfo(float).max)
_IOH_VERSION = "0.3.5"  # of the format


def write_iohprofiler(results: ResultSet, folder: Path) -> list[Path]:
    """Write a result set into a folder, all of it or nothing; returns the JSON files."""
    if "dimension" not in results.trials:
        raise InputError(f"the trials of {results.name} have no column `dimension`, which IOHprofiler needs")
    written = []
    with all_or_none(folder) as draft:
        for number, (label, trials, curves) in enumerate(results.cells(), start=1):
            dimension = int(trials["dimension"].iloc[0])
            for algorithm, runs in runs_by_algorithm(trials, curves).items():
                place = draft / file_name(algorithm)
                path = _write_ioh_problem(place, number, label, dimension, algorithm, list(runs.values()))
                written.append(folder / path.relative_to(draft))
    return written


def _write_ioh_problem(place: Path, number: int, label: str, dimension: int, algorithm: str, runs: list[Run]) -> Path:
    name = f"f{number}_{file_name(label)}"
    table = f"data_{name}/IOHprofiler_f{number}_DIM{dimension}.dat"
    make_folder(place / f"data_{name}")
    write_whole(place / table, "\n".join(["evaluations raw_y", *map(_ioh_rows, runs)]) + "\n")
    path = place / f"IOHprofiler_{name}.json"
    scenario = {"dimension": dimension, "path": table, "runs": [_ioh_run_summary(run) for run in runs]}
    write_whole(path, json.dumps(_ioh_header(number, label, algorithm) | {"scenarios": [scenario]}, indent=1) + "\n")
    return path


def _ioh_header(number: int, label: str, algorithm: str) -> dict[str, Any]:
    return {
        "version": _IOH_VERSION,
        "suite": "armlab",
        "function_id": number,
        "function_name": label,
        "maximization": False,
        "algorithm": {"name": algorithm, "info": "armlab"},
        "attributes": ["evaluations", "raw_y"],
    }


def _ioh_rows(run: Run) -> str:
    known = zip(run.evaluations.tolist(), _finite_best(run).tolist(), strict=True)
    return "\n".join([f"1 {NOTHING_KNOWN!r}", *(f"{evaluations:.0f} {value!r}" for evaluations, value in known)])


def _ioh_run_summary(run: Run) -> dict[str, Any]:
    best = _finite_best(run)
    first = int(best.argmin())
    found = {"evals": int(run.evaluations[first]), "y": float(best[first]), "x": []}
    return {"instance": 1, "evals": int(run.evaluations[-1]), "best": found}


def _finite_best(run: Run) -> Array:
    return np.asarray(np.minimum(run.best, NOTHING_KNOWN))


SHARED_FORMATS: Mapping[str, Callable[[ResultSet, Path], list[Path]]] = MappingProxyType(
    {
        "csv": lambda results, folder: write_tidy(results, folder, "csv"),
        "parquet": lambda results, folder: write_tidy(results, folder, "parquet"),
        "ioh": write_iohprofiler,
        **{form: partial(write_summary, form=form) for form in TABLE_FORMS},
    }
)


def read_results(where: Path, store: Path) -> ResultSet:
    """The results of a configuration (a YAML file; its outcomes are in the store) or of a folder of tidy tables.

    Raises InputError, in one line, if there are none.
    """
    if where.is_dir():
        return read_tidy(where)
    if not where.exists():
        raise InputError(f"there is no {where}: results are a configuration file, or a folder of tidy tables")
    return read_stored_results(where, store)


def share_results(where: Path, store: Path, form: str, folder: Path) -> list[Path]:
    """Write results in one of the formats into a folder; returns the files."""
    return SHARED_FORMATS[form](read_results(where, store), folder)
