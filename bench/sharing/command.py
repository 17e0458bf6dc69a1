"""What the commands on results have in common: where results are found, and in which forms they are given away."""

from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType

from bench.sharing.iohprofiler import write_iohprofiler
from bench.sharing.result_set import ResultSet, from_store
from bench.sharing.tidy import read_tidy, write_tidy
from problem.errors import InputError

FORMS: Mapping[str, Callable[[ResultSet, Path], list[Path]]] = MappingProxyType(
    {
        "csv": lambda results, folder: write_tidy(results, folder, "csv"),
        "parquet": lambda results, folder: write_tidy(results, folder, "parquet"),
        "ioh": write_iohprofiler,
    }
)


def read_results(where: Path, store: Path) -> ResultSet:
    """The results of a configuration (its YAML file; outcomes from the store), or those in a folder of tidy tables.

    Raises InputError, in one line, if there are none.
    """
    if where.is_dir():
        return read_tidy(where)
    if not where.exists():
        raise InputError(f"there is no {where}: results are a configuration file, or a folder of tidy tables")
    return from_store(where, store)


def share(where: Path, store: Path, form: str, folder: Path) -> list[Path]:
    """Write results in one of FORMS into a folder; returns the files."""
    return FORMS[form](read_results(where, store), folder)
