"""The score of comparisons: false changes of pairs with nothing changed, and right and wrong names of the others.

A change is named rightly where its effect and place are a finding or in the class of one, of three names at most.
Friction that grew by one factor may be named by each of its laws. Everything else that is named is a wrong name.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.pairs.pair_plan import CHANGE_KINDS, PAIRS
from armlab.proof.blind.score.cases import FAILURE_FILE
from armlab.proof.blind.score.share import Share

MAX_CLASS = 3  # names


@dataclass(frozen=True)
class PairOutcome:
    """One pair: what is true of it, and what was said.

    visible: whether the change is at least three detection limits. right: whether its name is there. wrong: names that
    are not true.
    """

    pair: str
    kind: str
    tier: str
    arm: str
    same_motion: bool
    drifting: bool
    multiple: float
    changed: list[dict[str, Any]]
    status: str
    named: list[list[Any]]
    right: bool
    wrong: int

    @property
    def visible(self) -> bool:
        """Whether it counts."""
        return self.multiple >= PAIRS.least_multiple


@dataclass(frozen=True)
class PairScore:
    """All outcomes and measures."""

    outcomes: tuple[PairOutcome, ...]
    measures: tuple[Share, ...]


def score_pairs(work: Path, names: Sequence[str], results: Path) -> PairScore:
    """Reads answers and verdicts, and writes changes.json and changes.md."""
    outcomes = tuple(judge_pair(work, name) for name in names)
    score = PairScore(outcomes, tuple(measures_of(outcomes)))
    content = [{**asdict(each), "visible": each.visible} for each in outcomes]
    texts = {"changes.json": json.dumps(content, indent=1) + "\n", "changes.md": score_page(score)}
    write_texts(texts, results)
    return score


def judge_pair(work: Path, name: str) -> PairOutcome:
    """One pair against its answer; a comparison that failed names nothing."""
    truth = json.loads((work / "truth" / f"{name}.json").read_text(encoding="utf-8"))
    out = work / "verdicts" / name
    verdict: dict[str, Any] = {"status": "failed", "findings": []}
    if not (out / FAILURE_FILE).is_file():
        verdict = json.loads((out / "comparison.json").read_text(encoding="utf-8"))
    right, wrong = count_names(truth["changed"], verdict["findings"])
    facts = {
        key: truth[key] for key in ("pair", "kind", "tier", "arm", "same_motion", "drifting", "multiple", "changed")
    }
    named = [[each["effect"], each["joint"]] for each in verdict["findings"]]
    return PairOutcome(**facts, status=verdict["status"], named=named, right=right, wrong=wrong)


def count_names(changed: Sequence[dict[str, Any]], findings: Sequence[dict[str, Any]]) -> tuple[bool, int]:
    """Whether the true change is named, and how many names are wrong."""
    true = {(each["effect"], each["joint"]) for each in changed}
    right, wrong = False, 0
    for finding in findings:
        first = (finding["effect"], finding["joint"])
        members = [first, *((each["effect"], each["joint"]) for each in finding.get("class") or ())]
        members = list(dict.fromkeys(members))[:MAX_CLASS]
        if true & set(members):
            right = True
        else:
            wrong += 1
    return right, wrong


def measures_of(outcomes: Sequence[PairOutcome]) -> Iterator[Share]:
    """The measures of all pairs, and by kind, tier and motion."""
    nulls = [each for each in outcomes if each.kind == "null"]
    seen = [each for each in outcomes if each.kind != "null" and each.visible]
    groups = {
        "": (nulls, seen),
        ", clean": ([e for e in nulls if e.tier == "clean"], [e for e in seen if e.tier == "clean"]),
        ", realistic": ([e for e in nulls if e.tier == "realistic"], [e for e in seen if e.tier == "realistic"]),
        ", same motion": ([e for e in nulls if e.same_motion], [e for e in seen if e.same_motion]),
        ", another motion": ([e for e in nulls if not e.same_motion], [e for e in seen if not e.same_motion]),
        ", drifting": ([e for e in nulls if e.drifting], []),
    }
    for name, (without, having) in groups.items():
        if without:
            yield Share(
                f"nothing changed, something named{name}", sum(e.status == "changed" for e in without), len(without)
            )
        if having:
            yield Share(f"right name or class of three{name}", sum(e.right for e in having), len(having))
            names = sum(len(e.named) for e in having)
            yield Share(f"wrong names among all names{name}", sum(e.wrong for e in having), names)
    for kind in CHANGE_KINDS:
        own = [each for each in seen if each.kind == kind]
        if own:
            yield Share(f"right name or class of three: {kind}", sum(each.right for each in own), len(own))


def score_lines(score: PairScore) -> Iterator[str]:
    """One line a measure."""
    yield from (f"{each.name}: {each.text}" for each in score.measures)


def score_page(score: PairScore) -> str:
    """Measures, and every pair that was not judged rightly."""
    rows = [(each.name, each.text) for each in score.measures]
    missed = [
        (each.pair, each.kind, each.tier, each.arm, f"{each.multiple:.1f}", _names(each.changed), str(each.named))
        for each in score.outcomes
        if each.wrong or (each.kind != "null" and each.visible and not each.right)
    ]
    hidden = sum(each.kind != "null" and not each.visible for each in score.outcomes)
    intro = (
        "Pairs of recordings of one simulated robot, with nothing changed between them or one thing: friction of a "
        f"joint +{100 * PAIRS.friction:.0f} %, a payload of {PAIRS.payload_kg:g} kg, a gain of {100 * PAIRS.gain:.0f} "
        f"%, a zero of {PAIRS.zero_deg:g} degrees. A change counts from {PAIRS.least_multiple:g} detection limits; "
        f"{hidden} changes were below that at every place drawn."
    )
    headings = ("pair", "kind", "tier", "arm", "limits", "true", "named")
    parts = [markdown_table(("measure", "value"), rows)]
    parts += ["## Pairs that were not judged rightly", markdown_table(headings, missed)] if missed else []
    return markdown_page("What changed: the proof", intro, *parts)


def _names(changed: Sequence[dict[str, Any]]) -> str:
    return ", ".join(f"{each['effect']} {each['joint']}" for each in changed)
