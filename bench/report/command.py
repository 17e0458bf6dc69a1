"""What `armlab report` does: results to one HTML file."""

from pathlib import Path

import yaml

from algorithms.registry import names as registered
from bench.files import write_whole
from bench.properties.facts import Facts, facts_of
from bench.report.analysis import cells_of
from bench.report.page import report_page
from bench.sharing.command import read_results
from bench.sharing.result_set import ResultSet
from bench.sharing.tidy import make_folder


def write_report(where: Path, store: Path, out: Path | None) -> Path:
    """Write the page about results; returns the file. Raises InputError, in one line, if there are no results."""
    results = read_results(where, store)
    path = out or Path("results") / f"{results.name}_report.html"
    make_folder(path.parent)
    write_whole(path, report_page(results, cells_of(results), _facts(results)))
    return path


def _facts(results: ResultSet) -> list[Facts]:
    """Of the algorithms that took part and are registered here: results may come from elsewhere."""
    took_part = dict.fromkeys(entry["name"] for entry in yaml.safe_load(results.settings)["algorithms"].values())
    return facts_of([name for name in took_part if name in registered()])
