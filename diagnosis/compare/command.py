"""`armlab diagnose --compare OLD NEW`: what changed, in files and lines."""

import json
import shlex
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import get_args

from armlab.diagnosis.settings import Baseline
from armlab.diagnosis.verdict_files import check_output_folder, write_texts
from diagnosis.compare.compare import compare
from diagnosis.compare.page import comparison_page
from diagnosis.compare.tell import as_json, terminal_lines
from problem.errors import InputError
from recordings.load import load_recording


def compare_recordings(
    old: Path,
    new: Path,
    out: Path,
    baseline: str | None,
    seed: int,
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[str]:
    """Compares, writes comparison.json and comparison.html into `out`, both or none, and tells the result in lines.

    Raises InputError, in one line, for recordings that cannot be used or are not of one robot.
    """
    chosen: Baseline | None = next((each for each in get_args(Baseline) if each == baseline), None)
    recordings = load_recording(old), load_recording(new)
    check_output_folder(out, recordings[1])
    try:
        found = compare(*recordings, chosen, seed, progress)
    except ValueError as error:
        raise InputError(f"{old} and {new}: {error}") from None
    options = [*(["--baseline", baseline] if baseline else []), *(["--seed", str(seed)] if seed else [])]
    command = shlex.join(["armlab", "diagnose", "--compare", str(old), str(new), "--out", str(out), *options])
    content = json.dumps(as_json(found), indent=1, allow_nan=False) + "\n"
    texts = {"comparison.json": content, "comparison.html": comparison_page(found, command)}
    write_texts(texts, out)
    yield from terminal_lines(found)
    yield f"wrote {out}: {', '.join(texts)}"
