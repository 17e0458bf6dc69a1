"""The page of the log of judged runs: all of them, of each set, with any score."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.score.measures import MEASURE_TEXTS

LOG_FILE, LOG_PAGE = "log.jsonl", "log.md"
HOW_TO_READ = """\
Every judged run of the proof, the latest first: a value, and the number of items that it was counted on. The seed of a
run follows from its commit (`armlab proof run`). A star stands at a commit beside which files were changed. The real
recordings are the same in each run, what is concealed in them is not. A cell is empty where the program of that day
did not count the measure. Some definitions have changed since. What was decided after looks at a judged run stands in
`docs/diagnosis.md` and `docs/proof.md`."""
Entry = Mapping[str, Any]


def write_log_page(log: Path) -> Path:
    """Writes the page beside the log. log: a line a run."""
    entries = [json.loads(line) for line in log.read_text(encoding="utf-8").splitlines()]
    sets = sorted({each["set"] for each in entries})
    parts = [part for name in sets for part in _section(name, [each for each in entries if each["set"] == name])]
    (page,) = write_texts({LOG_PAGE: markdown_page("Judged runs", HOW_TO_READ, *parts)}, log.parent)
    return page


def _section(name: str, entries: Sequence[Entry]) -> Iterator[str]:
    runs = entries[::-1]
    yield f"## {name}"
    for tier in runs[0]["score"]:
        heads = [f"{each['time'][:10]}, {each['commit'][:7]}{'*' if each['changed_files'] else ''}" for each in runs]
        scores = [each["score"].get(tier, {}) for each in runs]
        rows = [(_title(id), *(_cell(score.get(id)) for score in scores)) for id in scores[0]]
        yield markdown_table((f"{tier}, {runs[0]['cases']} cases", *heads), rows)


def _title(id: str) -> str:
    return MEASURE_TEXTS[id].title if id in MEASURE_TEXTS else id.replace("_", " ")


def _cell(figure: Sequence[float | None] | None) -> str:
    if figure is None or figure[0] is None:
        return ""
    return f"{figure[0]:.3g} of {figure[3]}"
