"""Table 2: the parameters in force in an experiment, against the printed ones."""

import dataclasses
from collections.abc import Iterator, Sequence

import pandas as pd

from bench.page import markdown_table, page
from bench.paper.settings import Table2Settings
from bench.plan import Entry
from bench.printed import Printed, display_name
from bench.table import as_csv

_NOTE = """\
`printed` is the value of Table 2, for MuPSO of the text; a dash stands where the paper is silent and the value is
ours or, for `b`, `attraction` and `attraction_length`, that of the algorithm's own paper. a of GWO and WOA falls to 0
in the number of iterations, from the printed first value."""


def table2(settings: Table2Settings, entries: Sequence[Entry], paper: Printed) -> dict[str, str]:
    """The files of Table 2."""
    table = pd.DataFrame(list(_rows(entries, paper)), columns=["algorithm", "parameter", "in force", "printed"])
    text = page(settings.name, markdown_table(list(table.columns), table.to_numpy().tolist()), _NOTE)
    return {f"{settings.name}.csv": as_csv(table), f"{settings.name}.md": text}


def differences(entries: Sequence[Entry], paper: Printed) -> list[str]:
    """Printed parameters that are not in force."""
    return [
        f"{algorithm} {name}: {ours}, printed {theirs}"
        for algorithm, name, ours, theirs in _rows(entries, paper)
        if theirs not in ("-", ours)
    ]


def _rows(entries: Sequence[Entry], paper: Printed) -> Iterator[tuple[str, str, str, str]]:
    for entry in {entry.algorithm: entry for entry in entries}.values():
        theirs = paper.table2.get(entry.trial.algorithm, {})
        for name, value in dataclasses.asdict(entry.trial.params).items():
            printed = f"{theirs[name]:g}" if name in theirs else "-"
            ours = value if isinstance(value, str) else f"{value:g}"
            yield display_name(entry.algorithm), name, ours, printed
