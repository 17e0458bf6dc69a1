"""The score of recordings of motion: names, classes, false claims, intervals and bias, from the verdicts alone.

A finding stands for a class: its name, its rivals and its members. A hidden effect has its right name where a finding
has its name, or one that no motion tells from it, at its joint; it has its right class where that name is in a class of
four names at most. A claim is wrong where its first name is not true. What a simulation lacks because it says nothing
of its drives is true, too: gains where kp is unknown; damping and torque limits as well where nothing is known. So is a
lower torque limit at any joint, where one that falls with the supply is hidden: all drives have the same supply.
"""

import json
from collections.abc import Collection, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import TypeAdapter

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import read_json
from armlab.proof.blind.formats import Manifest
from armlab.proof.blind.score.cases import UNKNOWN_NAME, read_complaint
from armlab.proof.blind.score.measures import NAMES_WANTED, Measure, share_measure
from armlab.proof.blind.score.share import Share
from armlab.proof.blind.score.stated import HEADING, StatedClaim, stated_lines, stated_measures, stated_table
from armlab.proof.blind.score.weighed_names import WeighedFinding, check_development, read_names
from armlab.proof.blind.sealed import VERDICTS, read_checked_manifest

MOTION_FILE = "motion.json"
MAX_CLASS = 4  # names
LEAST_MULTIPLE = 3.0  # detection limits of an effect that counts
SHOWN_COUNTS, SHOWN_RATE_HZ = 4096, 50.0  # of which bias is shown alone
LACKING = {
    "known": (),
    "partly": ("controller_gain_error",),
    "unknown": ("controller_gain_error", "viscous_friction", "torque_saturation"),
}

Name = tuple[str, int | None]  # effect, and joint from 1 or None for all


@dataclass(frozen=True)
class Number:
    """A reported number beside the true one. error: reported less true, over the width of the interval."""

    effect: str
    parameter: str
    held: bool
    error: float


@dataclass(frozen=True)
class HiddenOutcome:
    """What was said of one hidden effect. size: as in the answer. multiple: detection limits."""

    kind: str
    effect: str
    joint: int | None
    size: float
    multiple: float
    named: bool
    in_class: bool

    @property
    def visible(self) -> bool:
        """Whether it counts."""
        return self.multiple >= LEAST_MULTIPLE


@dataclass(frozen=True)
class ServoOutcome:
    """One case: what is true of it, and what was said. refused: why there is no verdict."""

    case: str
    kind: str
    law: str
    knowledge: str
    counts: int
    rate_hz: float
    status: str
    refused: str
    claims: list[str]
    wrong: list[str]
    hidden: list[HiddenOutcome]
    numbers: list[Number]
    single_wrong_numbers: int
    stated: list[StatedClaim]


@dataclass(frozen=True, eq=False)
class MotionScore:
    """The measures of a set, each with what was wanted, and those of the probabilities of names."""

    measures: list[tuple[Share, str]]
    stated: list[Measure]

    @property
    def lines(self) -> Iterator[str]:
        """The measures as lines."""
        yield from (f"{share.name}: {share.text}{f'; wanted {aim}' if aim else ''}" for share, aim in self.measures)
        yield from stated_lines(self.stated)


def score_motion(work: Path, names: Sequence[str], results: Path) -> MotionScore:
    """Judges all cases, and writes motion.md and motion.json."""
    outcomes = [_judge(work, name) for name in names]
    measures = _measure(outcomes)
    stated = stated_measures([claim for each in outcomes for claim in each.stated])
    page = markdown_page(
        "Recordings of motion: score",
        markdown_table(("measure", "value", "wanted"), [(share.name, share.text, aim) for share, aim in measures]),
        HEADING,
        stated_table(stated),
        f"## Effects above {LEAST_MULTIPLE:g} detection limits",
        markdown_table(("what is hidden", "cases", "right name", "right class"), _rows_of_kinds(outcomes)),
        "## Numbers\n\nError: reported less true, over the width of the 95 % interval; wanted below 0.25.",
        markdown_table(("number", "reported", "interval holds", "median error"), _rows_of_numbers(outcomes)),
        "## Misses and wrong claims",
        markdown_table(("case", "law, controller", "hidden (limits)", "said"), _rows_of_misses(outcomes)),
    )
    content = {"measures": [{**asdict(share), "wanted": aim} for share, aim in measures]}
    content |= {"probabilities": [asdict(each) for each in stated]}
    content |= {"cases": [asdict(each) for each in outcomes]}
    write_texts({"motion.md": page, MOTION_FILE: json.dumps(content, indent=1) + "\n"}, results)
    return MotionScore(measures, stated)


def read_motion_measures(folder: Path) -> list[Measure]:
    """The measures that all tiers have, from motion.json in a folder."""
    found = read_json(folder / MOTION_FILE)
    outcomes = TypeAdapter(list[ServoOutcome]).validate_python(found["cases"])
    nulls = [bool(each.wrong) for each in outcomes if each.kind == "null"]
    known = [each for each in outcomes if each.kind != "null" and each.knowledge == "known"]
    right = share_measure(
        "right_name_or_class", pd.Series([own.in_class for each in known for own in each.hidden if own.visible])
    )
    return [
        share_measure("false_claims_on_nulls", pd.Series(nulls)),
        replace(right, wanted=NAMES_WANTED["motion"]),
        *stated_measures([claim for each in outcomes for claim in each.stated]),
    ]


def _measure(outcomes: Sequence[ServoOutcome]) -> list[tuple[Share, str]]:
    nulls = [each for each in outcomes if each.kind == "null"]
    others = [each for each in outcomes if each.kind != "null"]
    known = [own for each in others if each.knowledge == "known" for own in each.hidden if own.visible]
    unknown = [own for each in others if each.knowledge != "known" for own in each.hidden if own.visible]
    without_kp = [each for each in outcomes if each.knowledge != "known"]
    numbers = [number for each in outcomes for number in each.numbers]
    limits = f"above {LEAST_MULTIPLE:g} limits"
    return [
        (Share("nulls with a false claim", sum(bool(each.wrong) for each in nulls), len(nulls)), "at most 2 %"),
        *(_false_claims(nulls, knowledge) for knowledge in LACKING),
        (Share("nulls without a verdict", sum(bool(each.refused) for each in nulls), len(nulls)), ""),
        (Share("cases without a verdict", sum(bool(each.refused) for each in others), len(others)), ""),
        (Share(f"{limits}: right name", sum(own.named for own in known), len(known)), ""),
        (Share(f"{limits}: right name or class of four", sum(own.in_class for own in known), len(known)), "85 %"),
        (Share(f"{limits}, kp unknown: in a class", sum(own.in_class for own in unknown), len(unknown)), "85 %"),
        (
            Share(
                "kp unknown: single wrong number",
                sum(each.single_wrong_numbers > 0 for each in without_kp),
                len(without_kp),
            ),
            "none",
        ),
        (Share("cases with a wrong claim", sum(bool(each.wrong) for each in others), len(others)), ""),
        (Share("intervals of 95 % that hold", sum(each.held for each in numbers), len(numbers)), "90 to 98 %"),
    ]


def _false_claims(nulls: Sequence[ServoOutcome], knowledge: str) -> tuple[Share, str]:
    """Of the nulls whose drives are known, partly or not."""
    own = [each for each in nulls if each.knowledge == knowledge]
    return Share(f"nulls with a false claim, drive {knowledge}", sum(bool(each.wrong) for each in own), len(own)), ""


def _rows_of_kinds(outcomes: Sequence[ServoOutcome]) -> list[tuple[str, ...]]:
    seen = [own for each in outcomes for own in each.hidden if own.visible]
    rows: list[tuple[str, ...]] = []
    for kind in sorted({own.kind for own in seen}):
        own = [each for each in seen if each.kind == kind]
        counts = len(own), sum(each.named for each in own), sum(each.in_class for each in own)
        rows.append((kind, *(str(count) for count in counts)))
    return rows


def _rows_of_numbers(outcomes: Sequence[ServoOutcome]) -> list[tuple[str, ...]]:
    """Each number in all cases, and in those of SHOWN_COUNTS and SHOWN_RATE_HZ."""
    shown = [each for each in outcomes if (each.counts, each.rate_hz) == (SHOWN_COUNTS, SHOWN_RATE_HZ)]
    rows: list[tuple[str, ...]] = []
    for label, cases in (("", outcomes), (f", {SHOWN_COUNTS} counts, {SHOWN_RATE_HZ:g} Hz", shown)):
        numbers = [number for each in cases for number in each.numbers]
        for name in sorted({(each.effect, each.parameter) for each in numbers}):
            own = [each for each in numbers if (each.effect, each.parameter) == name]
            median = float(np.median([each.error for each in own]))
            rows.append(
                (f"{name[0]} {name[1]}{label}", str(len(own)), str(sum(each.held for each in own)), f"{median:.2f}")
            )
    return rows


def _rows_of_misses(outcomes: Sequence[ServoOutcome]) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for each in outcomes:
        if each.wrong or each.refused or any(own.visible and not own.in_class for own in each.hidden):
            hidden = "; ".join(f"{own.kind}@{own.joint or '-'} ({own.multiple:.1f})" for own in each.hidden)
            said = each.refused or "; ".join(each.claims) or each.status
            rows.append((each.case, f"{each.law}, {each.knowledge}", hidden or "nothing", said))
    return rows


def _judge(work: Path, case: str) -> ServoOutcome:
    truth = json.loads((work / "truth" / f"{case}.json").read_text(encoding="utf-8"))
    folder = work / "verdicts" / case
    refused = read_complaint(folder)
    verdict = {} if refused else json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
    return judge(truth, verdict, refused)


def judge(truth: dict[str, Any], verdict: dict[str, Any], refused: str = "") -> ServoOutcome:
    """Judges a verdict (verdict/1, empty where there is none) by an answer (motion-truth/1)."""
    classes = [(finding, _class_of(finding)) for finding in verdict.get("findings", [])]
    lacking = LACKING[truth["knowledge"]]
    with_kd = {finding["joint"] for finding, _ in classes if "kd" in finding["parameters"]}
    numbers = [(finding, number) for finding, _ in classes for number in _compare(finding, truth, lacking, with_kd)]
    single = [number for finding, number in numbers if len(_class_of(finding)) == 1 and not number.held]
    return ServoOutcome(
        case=truth["case"],
        kind=truth["kind"],
        law=truth["law"],
        knowledge=truth["knowledge"],
        counts=truth["counts"],
        rate_hz=truth["rate_hz"],
        status=verdict.get("status", ""),
        refused=refused,
        claims=[", ".join(map(_label, own)) for _, own in classes],
        wrong=[_label(own[0]) for _, own in classes if not _is_true(own[0], truth, lacking)],
        hidden=[
            HiddenOutcome(
                kind=each["kind"],
                effect=each["effect"],
                joint=each["joint"],
                size=each["size"],
                multiple=each["multiple"],
                named=any(_names(own[0], each) for _, own in classes),
                in_class=any(len(own) <= MAX_CLASS and any(_names(name, each) for name in own) for _, own in classes),
            )
            for each in truth["injected"]
        ],
        numbers=[number for _, number in numbers],
        single_wrong_numbers=len(single),
        stated=[_stated(finding, own, truth, lacking) for finding, own in classes if own[0][0] not in lacking],
    )


def _stated(
    finding: dict[str, Any], names: Sequence[Name], truth: dict[str, Any], lacking: Sequence[str]
) -> StatedClaim:
    """A finding beyond what the simulation lacks anyhow. names: its own first, then those that it leaves open."""
    true = [_is_true(name, truth, lacking) for name in names]
    in_class = len(true) <= MAX_CLASS and any(true)
    return StatedClaim(finding["effect"], finding.get("probability"), true[0], in_class)


def _class_of(finding: dict[str, Any]) -> list[Name]:
    """The names that a finding leaves open, its own first."""
    others = [*(finding.get("class") or []), *finding.get("rivals", [])]
    others = [each for each in others if each["effect"] != UNKNOWN_NAME]
    names = [(each["effect"], each["joint"]) for each in (finding, *others)]
    return list(dict.fromkeys(names))


def _names(name: Name, hidden: dict[str, Any]) -> bool:
    """Whether a name is that of a hidden effect, or one that no motion tells from it."""
    right = name[0] == hidden["effect"] or name[0] in hidden["equivalent"]
    return right and hidden["joint"] in (None, name[1])


def _is_true(name: Name, truth: dict[str, Any], lacking: Sequence[str]) -> bool:
    hidden = truth["injected"]
    parts = [(each["part"], each["joint"]) for each in hidden]
    sagging = [each["effect"] for each in hidden if each["falling"]]  # the supply, and with it the limits of all drives
    return name[0] in (*lacking, *sagging) or name in parts or any(_names(name, each) for each in hidden)


def _compare(
    finding: dict[str, Any], truth: dict[str, Any], lacking: Sequence[str], with_kd: Collection[int | None]
) -> Iterator[Number]:
    """The numbers of a finding whose own name is true, beside the true ones.

    with_kd: joints whose kd has a finding. At the others, damping is that of joint and drive where nothing is known.
    """
    effect, joint = finding["effect"], finding["joint"]
    own = [each for each in truth["injected"] if each["effect"] == effect and each["joint"] in (None, joint)]
    if joint is None or not (own or effect in lacking) or any(each["falling"] for each in own):
        return
    drive = truth["drives"][joint - 1]
    true = {**drive.get(effect, {}), **(own[0]["parameters"] if own else {})}
    if effect == "viscous_friction" and effect in lacking and joint not in with_kd:
        true["coefficient"] += drive["controller_gain_error"]["kd"]
    for name, reported in finding["parameters"].items():
        interval = reported["ci95"]
        if name in true and interval is not None and np.ndim(interval) == 1 and interval[1] > interval[0]:
            low, high = interval
            yield Number(effect, name, low <= true[name] <= high, (reported["value"] - true[name]) / (high - low))


def read_weighed_motion(work: Path) -> tuple[str, list[WeighedFinding]]:
    """What a development set is, and the names that were weighed for the findings in it.

    Raises InputError for a folder that holds no verdicts, for a set that was changed since it was sealed, and for one
    that judges: nothing is learnt from it.
    """
    manifest, _ = read_checked_manifest(work, Manifest)
    check_development(manifest.seed, work)
    cases = [name for name in manifest.cases if (work / VERDICTS / name).is_dir()]
    if not cases:
        raise InputError(f"{work} holds no verdicts: `armlab proof run --tier motion` makes them")
    about = f"motion, seed {manifest.seed}: {len(cases)} cases"
    return about, [each for case in cases for each in _weighed_findings(work, case, manifest.seed)]


def _weighed_findings(work: Path, case: str, seed: int) -> Iterator[WeighedFinding]:
    truth = json.loads((work / "truth" / f"{case}.json").read_text(encoding="utf-8"))
    lacking = LACKING[truth["knowledge"]]
    for names in read_names(work / "verdicts" / case):
        own = [(each["effect"], each["joint"]) for each in names]
        named = [name[0] != UNKNOWN_NAME for name in own]
        right = [is_name and _is_true(name, truth, lacking) for name, is_name in zip(own, named, strict=True)]
        likeliest = max(range(len(names)), key=lambda at: names[at]["probability"])
        yield WeighedFinding(
            case=f"{seed} {case}",
            tier="motion",
            names=tuple(each["numbers"] for each in names),
            right=tuple(each if is_name else not any(right) for each, is_name in zip(right, named, strict=True)),
            background=own[likeliest][0] in lacking,
        )


def _label(name: Name) -> str:
    return f"{name[0]}@{name[1] or '-'}"
