"""The score of comparisons: false changes of pairs with nothing changed, and names and intervals of the others.

A change is named rightly where its effect and place are a finding or in the class of one, of three names at most.
Friction that grew by one factor may be named by each of its laws. Everything else that is named is a wrong name, but
friction of a joint that was warmer or colder, which is neither right nor wrong. An interval is judged where the number
that changed is named and known.

Plain least squares, which shares nothing with the comparison, is fitted to both recordings of each pair: where it sees
a change beyond `SEEN_ERRORS` standard errors, the comparison may not say "same". Where nothing changed, it may see none
there itself: else it would be no yardstick. Between other motions it is none, as what a model lacks differs there.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from armlab.common.errors import DataError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import read_json
from armlab.proof.blind.pairs.pair_cases import SIDES
from armlab.proof.blind.pairs.pair_plan import CHANGE_KINDS, PAIRS
from armlab.proof.blind.score.cases import FAILURE_FILE
from armlab.proof.blind.score.share import Share
from armlab.recordings.plain_least_squares import SEEN_ERRORS, compare_plain_folders

MAX_CLASS = 3  # names
FALSE, RIGHT, WRONG = "nothing changed, something named", "right name or class of three", "wrong names among all names"
COVERED = "intervals that hold the truth"
SEEN = f"{RIGHT}, where plain least squares sees more than {SEEN_ERRORS:g} standard errors"
MISSED = f'"same" where plain least squares sees more than {SEEN_ERRORS:g} standard errors'
BROKEN_YARDSTICK = f"nothing changed, plain least squares sees more than {SEEN_ERRORS:g} standard errors"
WANTED = {FALSE: "at most 2%", RIGHT: "at least 95%", COVERED: "90% to 98%", MISSED: "none", BROKEN_YARDSTICK: "none"}


@dataclass(frozen=True)
class PairOutcome:
    """One pair: what is true of it, and what was said.

    size: of the change, in detection limits, or in strengths of the field tier. visible: whether it counts. right:
    whether its name is there. wrong: names that are not true. covered: of each interval of a number that is known,
    whether it holds it. plain: the largest change that plain least squares sees, standard errors; None where no run is
    long enough.
    """

    pair: str
    kind: str
    tier: str
    arm: str
    same_motion: bool
    drifting: bool
    size: float
    visible: bool
    changed: list[dict[str, Any]]
    status: str
    named: list[list[Any]]
    right: bool
    wrong: int
    covered: list[bool]
    plain: float | None

    @property
    def is_seen_plainly(self) -> bool:
        """Whether plain least squares sees a change."""
        return self.plain is not None and self.plain > SEEN_ERRORS


def score_pairs(work: Path, names: Sequence[str], results: Path) -> tuple[Share, ...]:
    """The measures, from observations, answers and verdicts; writes changes.json and changes.md."""
    outcomes = tuple(judge_pair(work, name) for name in names)
    measures = tuple(measures_of(outcomes))
    content = json.dumps([asdict(each) for each in outcomes], indent=1) + "\n"
    write_texts({"changes.json": content, "changes.md": score_page(outcomes, measures)}, results)
    return measures


def judge_pair(work: Path, name: str) -> PairOutcome:
    """One pair against its answer; a comparison that failed names nothing."""
    truth = read_json(work / "truth" / f"{name}.json")
    out = work / "verdicts" / name
    verdict: dict[str, Any] = {"status": "failed", "findings": [], "changes": []}
    if not (out / FAILURE_FILE).is_file():
        verdict = read_json(out / "comparison.json")
    right, wrong = count_names(truth["changed"], verdict["findings"], truth["warmed"])
    return PairOutcome(
        **{key: value for key, value in truth.items() if key not in ("schema", "warmed")},
        status=verdict["status"],
        named=[[each["effect"], each["joint"]] for each in verdict["findings"]],
        right=right,
        wrong=wrong,
        covered=list(judge_intervals(truth["changed"], verdict["changes"])),
        plain=_plain_errors(work / "observations" / name),
    )


def _plain_errors(observation: Path) -> float | None:
    try:
        return compare_plain_folders(observation / SIDES[0], observation / SIDES[1]).largest
    except DataError:
        return None


def count_names(
    changed: Sequence[dict[str, Any]], findings: Sequence[dict[str, Any]], warmed: Sequence[Sequence[Any]] = ()
) -> tuple[bool, int]:
    """Whether the true change is named, and how many names are wrong. warmed: effects and joints that are not."""
    allowed = {(effect, joint) for effect, joint in warmed}
    true = {(each["effect"], each["joint"]) for each in changed}
    right, wrong = False, 0
    for finding in findings:
        first = (finding["effect"], finding["joint"])
        members = [first, *((each["effect"], each["joint"]) for each in finding.get("class") or ())]
        members = list(dict.fromkeys(members))[:MAX_CLASS]
        if true & set(members):
            right = True
        elif first not in allowed:
            wrong += 1
    return right, wrong


def judge_intervals(changed: Sequence[dict[str, Any]], rows: Sequence[dict[str, Any]]) -> Iterator[bool]:
    """Whether each 95 % interval of a number that changed, is named and known holds it."""
    for true in changed:
        for row in rows:
            if row["changed"] and (row["effect"], row["joint"]) == (true["effect"], true["joint"]):
                known = true["differences"].get(row["parameter"])
                if known is not None:
                    low, high = row["difference_ci95"]
                    yield bool(low <= known <= high)


def measures_of(outcomes: Sequence[PairOutcome]) -> Iterator[Share]:
    """The measures of all pairs, by half, tier and motion; names also by kind."""
    halves = {
        "": list(outcomes),
        ", simulated": [each for each in outcomes if each.tier != "field"],
        ", field": [each for each in outcomes if each.tier == "field"],
    }
    for name, own in halves.items():
        yield from _measure(own, name)
        yield from _measure_plainly(own, name)
    parts = {
        ", clean": [each for each in outcomes if each.tier == "clean"],
        ", realistic": [each for each in outcomes if each.tier == "realistic"],
        ", same motion": [each for each in outcomes if each.same_motion],
        ", another motion": [each for each in outcomes if not each.same_motion],
        ", drifting": [each for each in outcomes if each.drifting],
    }
    for name, own in parts.items():
        yield from _measure(own, name)
    for name in (", same motion", ", another motion"):
        yield from _measure_plainly(parts[name], name)
    for kind in CHANGE_KINDS:
        seen = [each for each in outcomes if each.kind == kind and each.visible]
        if seen:
            yield Share(f"{RIGHT}: {kind}", sum(each.right for each in seen), len(seen))


def _measure(outcomes: Sequence[PairOutcome], name: str) -> Iterator[Share]:
    """What was named, and how well. name: of the part of all pairs."""
    nulls = [each for each in outcomes if each.kind == "null"]
    seen = [each for each in outcomes if each.kind != "null" and each.visible]
    covered = [each for outcome in outcomes for each in outcome.covered]
    if nulls:
        yield Share(f"{FALSE}{name}", sum(each.wrong > 0 for each in nulls), len(nulls))
    if seen:
        yield Share(f"{RIGHT}{name}", sum(each.right for each in seen), len(seen))
        yield Share(f"{WRONG}{name}", sum(each.wrong for each in seen), sum(len(each.named) for each in seen))
    if covered:
        yield Share(f"{COVERED}{name}", sum(covered), len(covered))


def _measure_plainly(outcomes: Sequence[PairOutcome], name: str) -> Iterator[Share]:
    """What was said where plain least squares sees a change, and whether it is a yardstick."""
    nulls = [each for each in outcomes if each.kind == "null" and each.plain is not None]
    seen = [each for each in outcomes if each.kind != "null" and each.is_seen_plainly]
    if seen:
        yield Share(f"{SEEN}{name}", sum(each.right for each in seen), len(seen))
        yield Share(f"{MISSED}{name}", sum(each.status == "same" for each in seen), len(seen))
    if nulls:
        yield Share(f"{BROKEN_YARDSTICK}{name}", sum(each.is_seen_plainly for each in nulls), len(nulls))


def score_page(outcomes: Sequence[PairOutcome], measures: Sequence[Share]) -> str:
    """Measures, and every pair that was not judged rightly."""
    rows = [(each.name, each.text, _wanted(each.name)) for each in measures]
    missed = [
        (
            each.pair,
            each.kind,
            each.tier,
            each.arm,
            f"{each.size:.1f}",
            _names(each.changed),
            str(each.named) if each.named else each.status,
            "-" if each.plain is None else f"{each.plain:.1f}",
        )
        for each in outcomes
        if each.wrong
        or (each.kind != "null" and each.visible and not each.right)
        or (each.is_seen_plainly and (each.kind == "null" or each.status == "same"))
    ]
    hidden = sum(each.kind != "null" and not each.visible for each in outcomes)
    intro = (
        "Pairs of recordings of one robot, with nothing changed between them or one thing. *Simulated*: friction of a "
        f"joint +{100 * PAIRS.friction:.0f} %, a payload of {PAIRS.payload_kg:g} kg, a gain of {100 * PAIRS.gain:.0f} "
        f"%, a zero of {PAIRS.zero_deg:g} degrees; a change counts from {PAIRS.least_multiple:g} detection limits. "
        "*Field*: the same things on recordings that resemble real ones, on two days, so that friction is warmer or "
        f"colder, whose name is not false from 5 %; sized by strength. {hidden} changes were too small at every place "
        "drawn."
    )
    plainly = (
        "Plain least squares (base parameters, rotor inertia, Coulomb and viscous friction, offsets; "
        "`armlab/recordings/plain_least_squares.py`) is fitted to each recording, and the difference of each parameter "
        "divided by its standard error by blocks of time. Intervals are judged where a number is named and known: of "
        "the field half those of gains and zeros."
    )
    headings = ("pair", "kind", "tier", "arm", "size", "true", "named", "plain, errors")
    parts = [markdown_table(("measure", "value", "wanted"), rows), plainly]
    parts += ["## Pairs that were not judged rightly", markdown_table(headings, missed)] if missed else []
    return markdown_page("What changed: the proof", intro, *parts)


def _wanted(measure: str) -> str:
    return next((wanted for name, wanted in WANTED.items() if measure.startswith(name)), "")


def _names(changed: Sequence[dict[str, Any]]) -> str:
    return ", ".join(f"{each['effect']} {each['joint']}" for each in changed)
