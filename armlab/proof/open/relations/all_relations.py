"""All relations on all recordings at hand: a table of what holds, what is broken, where and why.

Outcomes are stored with the code and the data that they follow from; an interrupted run continues.
"""

import hashlib
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.report.wording import join_words
from armlab.common.statistics import wilson_interval
from armlab.proof.open.relations.relations import NULL_PAIRS, PARTS, RELATIONS, Desk, RelationOutcome, check_relation
from armlab.proof.open.stored import code_digest, recording_digest
from armlab.recordings.load import load_recording
from armlab.recordings.public import PUBLIC_RECORDINGS, is_available, open_public_recording
from armlab.recordings.recording import Recording

STORE = "relations.jsonl"
PAGE = "relations.md"
PAGES = {frozenset(NULL_PAIRS): "null-pairs.md", frozenset({PARTS}): "parts.md"}  # of some relations alone
ANSWERS = {True: "held", False: "**broken**", None: "no answer"}


def check_relations(
    results: Path,
    recordings: Path,
    folders: Sequence[Path] = (),
    only: Sequence[str] = (),
    names: Sequence[str] = tuple(RELATIONS),
    progress: Callable[[str], None] = lambda message: None,
) -> Iterator[str]:
    """Lines on each outcome, and on the page that is written.

    recordings: where public recordings are, or will be fetched to, those of which the files are at hand. folders: of
    further recordings. only: names of the recordings that are taken. names: of the relations.
    """
    stored = _read(results / STORE)
    outcomes: list[RelationOutcome] = []
    for recording in _at_hand(recordings, folders, only):
        desk = Desk()
        for number, name in enumerate(names, 1):
            key = _key(recording, name)
            if key not in stored:
                progress(f"relations of {recording.name}, {number} of {len(names)}: {name}")
                stored[key] = check_relation(name, recording, desk)
                _append(results / STORE, key, stored[key])
            outcomes.append(stored[key])
            yield f"{recording.name}: {name}: {ANSWERS[stored[key].holds].strip('*')} ({stored[key].detail})"
    page = PAGES.get(frozenset(names), PAGE)
    if set(names) & set(NULL_PAIRS):
        yield count_null_pairs(outcomes)
    yield from (f"wrote {path}" for path in write_texts({page: relations_page(outcomes)}, results))


def _at_hand(recordings: Path, folders: Sequence[Path], only: Sequence[str]) -> Iterator[Recording]:
    for name, public in PUBLIC_RECORDINGS.items():
        if (not only or name in only) and (is_available(public) or (recordings / name).is_dir()):
            yield open_public_recording(name, recordings)
    for folder in folders:
        if not only or folder.resolve().name in only:
            yield load_recording(folder)


def _key(recording: Recording, name: str) -> str:
    code = code_digest(*Path(__file__).parent.glob("*.py"))
    whole = f"{code} {recording_digest(recording)} {recording.name} {name}"
    return hashlib.sha256(whole.encode()).hexdigest()


def _read(path: Path) -> dict[str, RelationOutcome]:
    if not path.is_file():
        return {}
    rows = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines() if line]
    return {row["key"]: RelationOutcome(row["recording"], row["relation"], row["holds"], row["detail"]) for row in rows}


def _append(path: Path, key: str, outcome: RelationOutcome) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps({"key": key, **asdict(outcome)}) + "\n")


def relations_page(outcomes: Sequence[RelationOutcome]) -> str:
    """A table of relations by recordings, then what is broken and why."""
    recordings = list(dict.fromkeys(each.recording for each in outcomes))
    relations = list(dict.fromkeys(each.relation for each in outcomes))
    found = {(each.relation, each.recording): each for each in outcomes}
    rows = []
    for relation in relations:
        own = [found.get((relation, recording)) for recording in recordings]
        rows.append((relation, *("–" if each is None else ANSWERS[each.holds] for each in own)))
    intro = (
        "Relations that hold whatever is true of the robot, so that no answer is needed to check them "
        "(`armlab proof relations`). A broken one is a fault of the diagnosis or of the comparison."
    )
    counted = (count_null_pairs(outcomes),) if set(relations) & set(NULL_PAIRS) else ()
    parts = [markdown_table(("relation", *recordings), rows), *counted, "## Details"]
    details = [(each.recording, each.relation, ANSWERS[each.holds], each.detail) for each in outcomes]
    return markdown_page("Relations", intro, *parts, markdown_table(("recording", "relation", "", "why"), details))


def count_null_pairs(outcomes: Sequence[RelationOutcome]) -> str:
    """How often a change is named between stretches of one recording that are independent of each other."""
    answered = [each for each in outcomes if each.relation in NULL_PAIRS and each.holds is not None]
    if not answered:
        return f"Stretches that are independent of each other ({join_words(NULL_PAIRS)}) have no answer."
    named = sum(each.holds is False for each in answered)
    low, high = wilson_interval(named, len(answered))
    return (
        f"Stretches that are independent of each other ({join_words(NULL_PAIRS)}): {len(answered)} answers, a change "
        f"is named in {named} (95 % interval {100 * low:.3g} to {100 * high:.3g} %)."
    )
