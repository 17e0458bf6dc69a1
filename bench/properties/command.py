"""What `armlab properties` does: measure, and write the page and the table."""

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path

import pandas as pd

from algorithms.registry import names as registered
from bench.files import write_whole
from bench.page import markdown_table, page
from bench.properties.facts import facts_of
from bench.properties.table import HEADINGS, READING, rows
from bench.sharing.tidy import make_folder
from bench.table import as_csv


def write_properties(names: Sequence[str], folder: Path) -> list[Path]:
    """Write `properties.md` and `properties.csv` of the algorithms, all registered ones if none is named."""
    facts = facts_of(names or registered())
    table = pd.DataFrame([asdict(fact) | {"in_words": fact.verdict} for fact in facts])
    make_folder(folder)
    files = {
        "properties.md": page("Properties of the algorithms", markdown_table(HEADINGS, rows(facts)), READING),
        "properties.csv": as_csv(table),
    }
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]
