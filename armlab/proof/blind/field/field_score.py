"""The score of field cases: false reading mistakes, false names, open verdicts; and what is hidden that is named.

A name is false where it is neither in the background nor hidden, nor told from one of them by no motion (the table of
`score/cases.py`). `unknown` is always true: every case has a rest that no law explains. A reading mistake is named
where its finding, or the class of it, of three names at most, holds it; torque of the other sign and a position that
counts the other way are the same.
"""

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import read_json, validate
from armlab.proof.blind.field.field_truth import FieldTruth, PlacedEffect, TrueMistake
from armlab.proof.blind.score.cases import UNKNOWN_NAME, VALID_STATUSES, is_indistinguishable, read_complaint
from armlab.proof.blind.score.share import Share

MAX_CLASS = 3  # names
FALSE_READING, FALSE_NAME = "a false reading mistake", "a false name"
WANTED = {f"nulls: {FALSE_READING}": "at most 1%"}
VERDICT_FILE = "verdict.json"
LEAST_STRENGTH = 0.7  # of a hidden effect that counts
DOUBT = re.compile(r"(?<!othing is )read wrongly|may be read|not be excluded|cannot (?:be excluded|exclude)")
SAME_READING = {"torque_sign": "joint_direction", "joint_direction": "torque_sign"}


@dataclass(frozen=True)
class FieldOutcome:
    """One case: what is true of it, and what was said.

    true: what is hidden or wrong, as effect@joint. visible: whether it counts. named: names of physics; false: those
    that are not true. setup: names of reading mistakes; false_setup: those that are not there.
    doubt: whether the summary says that the recording may be read wrongly. right, in_class: whether what is true is
    named, or is in the class of a finding.
    """

    case: str
    kind: str
    robot: str
    joints: int
    status: str
    true: list[str]
    visible: bool
    named: list[str]
    false: list[str]
    setup: list[str]
    false_setup: list[str]
    doubt: bool
    right: bool
    in_class: bool


@dataclass(frozen=True)
class FieldScore:
    """All outcomes and measures."""

    outcomes: tuple[FieldOutcome, ...]
    measures: tuple[Share, ...]


def score_field(truths: Path, verdicts: Path, names: Sequence[str], results: Path) -> FieldScore:
    """Reads answers and verdicts, and writes field.json and field.md."""
    outcomes = tuple(judge_field_case(truths / f"{name}.json", verdicts / name) for name in names)
    score = FieldScore(outcomes, tuple(measure_field(outcomes)))
    content = json.dumps([asdict(each) for each in outcomes], indent=1) + "\n"
    write_texts({"field.json": content, "field.md": _page(score)}, results)
    return score


def judge_field_case(truth_file: Path, folder: Path) -> FieldOutcome:
    """One case against its answer; without a verdict nothing is named."""
    truth = validate(FieldTruth, read_json(truth_file), str(truth_file))
    complaint = read_complaint(folder)
    verdict: dict[str, Any] = {"status": complaint or "no verdict", "findings": []}
    if (folder / VERDICT_FILE).is_file() and not complaint:
        verdict = read_json(folder / VERDICT_FILE)
    return judge_verdict(truth, verdict)


def judge_verdict(truth: FieldTruth, verdict: dict[str, Any]) -> FieldOutcome:
    """See the module. verdict: of a diagnosis."""
    findings = verdict["findings"]
    setup = [each for each in findings if each.get("kind") == "setup"]
    physics = [each for each in findings if each.get("kind") != "setup"]
    sought: Sequence[PlacedEffect] = truth.hidden or truth.mistakes
    about = setup if truth.mistakes else physics
    right, in_class = (_are_named(truth, about, names) for names in (1, MAX_CLASS))
    false = [] if truth.mistakes else [each for each in physics if not is_true_name(truth, each)]
    return FieldOutcome(
        case=truth.case,
        kind=truth.kind,
        robot=truth.robot,
        joints=truth.joints,
        status=verdict["status"],
        true=[_label(each.effect, each.joint) for each in sought],
        visible=_is_visible(truth),
        named=[_label(each["effect"], each["joint"]) for each in physics],
        false=[_label(each["effect"], each["joint"]) for each in false],
        setup=[_label(each["effect"], each["joint"]) for each in setup],
        false_setup=[_label(each["effect"], each["joint"]) for each in setup if not _is_true_mistake(truth, each)],
        doubt=bool(DOUBT.search(verdict.get("summary") or "")),
        right=right,
        in_class=in_class,
    )


def is_true_name(truth: FieldTruth, finding: dict[str, Any]) -> bool:
    """Whether a name of physics is there, or cannot be told by any motion from what is there."""
    name, place = finding["effect"], finding["joint"]
    if name == UNKNOWN_NAME:
        return True
    there = (*truth.hidden, *truth.background)
    return any(
        (name, place) == (each.effect, each.joint)
        or is_indistinguishable(name, place, each.effect, each.joint, truth.joints, ())
        for each in there
    )


def measure_field(outcomes: Sequence[FieldOutcome]) -> Iterator[Share]:
    """The measures of each kind of case that there is."""
    kinds = {kind: [each for each in outcomes if each.kind == kind] for kind in {each.kind for each in outcomes}}
    single = [*kinds.get("null", []), *kinds.get("hidden", [])]
    for name, own in (("nulls", kinds.get("null", [])), ("hidden effects", kinds.get("hidden", []))):
        if own:
            misread = sum(bool(each.false_setup) or each.doubt for each in own)
            yield Share(f"{name}: {FALSE_READING}", misread, len(own))
            yield Share(f"{name}: {FALSE_NAME}", sum(bool(each.false) for each in own), len(own))
            yield Share(f"{name}: inconclusive", sum(each.status == "inconclusive" for each in own), len(own))
    if single:
        missing = sum(each.status not in VALID_STATUSES for each in single)
        yield Share("nulls and hidden effects: no verdict", missing, len(single))
    for kind, name in (("hidden", "hidden effects"), ("mistake", "mistakes")):
        own = [each for each in kinds.get(kind, []) if each.visible]
        if own:
            yield Share(f"{name}: named", sum(each.right for each in own), len(own))
            yield Share(f"{name}: named, or in a class of three", sum(each.in_class for each in own), len(own))


def _is_visible(truth: FieldTruth) -> bool:
    if truth.hidden:
        return all(each.strength >= LEAST_STRENGTH for each in truth.hidden)
    return all(each.seen for each in truth.mistakes)


def _are_named(truth: FieldTruth, findings: Sequence[dict[str, Any]], names: int) -> bool:
    """Whether all that is sought is among the first names of a finding."""
    if truth.mistakes:
        return all(any(_is_mistake(true, each, names) for each in findings) for true in truth.mistakes)
    sought = [(each.effect, each.joint) for each in truth.hidden]
    return bool(sought) and all(any(true in _members(each)[:names] for each in findings) for true in sought)


def _members(finding: dict[str, Any]) -> list[tuple[str, int | None]]:
    own = [(finding["effect"], finding["joint"])]
    own += [(each["effect"], each["joint"]) for each in finding.get("class") or []]
    return list(dict.fromkeys(own))[:MAX_CLASS]


def _is_mistake(true: TrueMistake, finding: dict[str, Any], names: int) -> bool:
    members = _members(finding)[:names]
    accepted = {true.effect, SAME_READING.get(true.effect, true.effect)}
    if len(true.joints) > 1:  # an exchanged pair
        exchanged = tuple(finding.get("joints") or ()) == true.joints
        return exchanged and any(name in accepted for name, _ in members)
    return any(name in accepted and place == true.joint for name, place in members)


def _is_true_mistake(truth: FieldTruth, finding: dict[str, Any]) -> bool:
    return any(_is_mistake(true, finding, MAX_CLASS) for true in truth.mistakes)


def _label(effect: str, joint: int | None) -> str:
    return f"{effect}@{joint if joint is not None else '-'}"


def _page(score: FieldScore) -> str:
    heads = ("case", "kind", "robot", "true", "said", "false", "reading", "status")
    rows = [
        (
            each.case,
            each.kind,
            f"{each.robot}, {each.joints}",
            "; ".join(each.true) or "-",
            "; ".join(each.named) or "-",
            "; ".join(each.false) or "-",
            "; ".join(each.setup) or ("a doubt" if each.doubt else "-"),
            each.status,
        )
        for each in score.outcomes
    ]
    return markdown_page(
        "Field recordings: score",
        markdown_table(("measure", "value"), [(each.name, each.text) for each in score.measures]),
        "## Every case",
        markdown_table(heads, rows),
    )
