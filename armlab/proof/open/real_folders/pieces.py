"""Pieces of recording folders: both halves of each run, and one of two rows. What is known of the whole judges them.

A piece is a recording that nobody has looked at while a rule was made, though its arm may be known. It is cut from the
files, not from what was read of them, so that import, clock and repairs are judged, too.
"""

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import yaml

from armlab.common.settings import read_yaml, to_plain_data
from armlab.proof.open.real_folders.facts import FactsFile
from armlab.proof.open.real_folders.recording_folders import RecordingFolder
from armlab.recordings.recording_file import FILE_NAME, read_recording_file

Rows = list[str]
PIECES: dict[str, Callable[[Rows], Rows]] = {
    "first-half": lambda rows: rows[: len(rows) // 2],
    "second-half": lambda rows: rows[len(rows) // 2 :],
    "every-second-row": lambda rows: rows[::2],
}
THINNED = "every-second-row"
TABLE_SUFFIX = ".csv"  # of runs that can be cut


def name_of_piece(folder: str, piece: str) -> str:
    """The name of a piece of a folder."""
    return f"{folder}--{piece}"


def write_pieces(folders: Sequence[RecordingFolder], into: Path) -> Iterator[RecordingFolder]:
    """Writes the pieces of single recordings whose runs are tables; others, and pairs, have none."""
    for each in folders:
        runs = () if each.pair else tuple(entry.file for entry in read_recording_file(each.path).runs)
        if runs and all(file.endswith(TABLE_SUFFIX) for file in runs):
            for piece in PIECES:
                name = name_of_piece(each.name, piece)
                _write_piece(each.path, runs, piece, into / name)
                yield RecordingFolder(name, into / name, pair=False)


def _write_piece(whole: Path, runs: Sequence[str], piece: str, out: Path) -> None:
    shutil.rmtree(out, ignore_errors=True)
    shutil.copytree(whole, out)
    for file in dict.fromkeys(runs):
        heading, *rows = (whole / file).read_text(encoding="utf-8").splitlines(keepends=True)
        (out / file).write_text("".join([heading, *PIECES[piece](rows)]), encoding="utf-8")
    content = read_yaml(whole / FILE_NAME)
    for key in ("robot", "simulation"):
        if content.get(key) and (whole / content[key]).is_file() and not (out / content[key]).is_file():
            content[key] = str((whole / content[key]).resolve())
    if piece == THINNED and content.get("sample_rate_hz"):
        content["sample_rate_hz"] /= 2
    (out / FILE_NAME).write_text(yaml.safe_dump(to_plain_data(content), sort_keys=False), encoding="utf-8")


def facts_of_pieces(facts: FactsFile) -> FactsFile:
    """What is known of the pieces of all single recordings."""
    singles = {name_of_piece(name, piece): known for name, known in facts.singles.items() for piece in PIECES}
    return facts.model_copy(update={"singles": singles, "pairs": {}})
