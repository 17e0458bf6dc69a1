"""The score: right names of the mistakes that can be seen, and setup findings where nothing is wrong.

A mistake is named rightly where its effect and place are a setup finding, or in the class of one, of three names at
most. What no motion tells from it counts as it: torque of the other sign and a joint whose position alone counts the
other way round.
"""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from pydantic import TypeAdapter
from scipy.stats import fisher_exact

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.score.cases import read_complaint
from armlab.proof.blind.score.measures import NAMES_WANTED, Measure, share_measure
from armlab.proof.blind.score.share import Share
from armlab.proof.blind.score.stated import HEADING, StatedClaim, stated_lines, stated_measures, stated_table
from armlab.proof.blind.setup.lapse import likeliest_odds_ratio
from armlab.proof.blind.setup.setup_plan import SetupCase

SETUP_FILE = "setup.json"
MAX_CLASS = 3  # names
GRAVITY_DEG = 3.0
LAPSE = "odds that no name is right, times those that are stated"
CHANCE = "hidden physics: probability of such a difference by chance"


@dataclass(frozen=True)
class SetupOutcome:
    """One case: what is true of it, and what was said. right: of each mistake. false: findings that are not true.

    physics_right: hidden physics that is named, of `physics`. gravity_off: degrees between the direction of gravity
    that was found and the right one, None where none was found or none was turned.
    """

    case: str
    source: str
    kind: str
    mistakes: list[str]
    seen: list[bool]
    named: list[str]
    right: list[bool]
    false: int
    status: str
    physics: int
    physics_right: int
    gravity_off: float | None
    stated: list[StatedClaim]


@dataclass(frozen=True, eq=False)
class SetupScore:
    """The measures of a set, and those of the probabilities of setup findings in it, all and on real recordings."""

    shares: list[Share]
    outcomes: list[SetupOutcome]

    @property
    def stated(self) -> list[Measure]:
        """Of all sources."""
        return stated_measures([claim for each in self.outcomes for claim in each.stated])

    @property
    def stated_real(self) -> list[Measure]:
        """Of public recordings."""
        return stated_measures([claim for each in self.outcomes if each.source == "real" for claim in each.stated])

    @property
    def odds_ratio(self) -> str:
        """The likeliest odds of a lapse, times those that are stated."""
        ratio = likeliest_odds_ratio([claim for each in self.outcomes for claim in each.stated])
        return "-" if ratio is None else f"{ratio:.2g}"

    @property
    def lines(self) -> Iterator[str]:
        """The measures as lines."""
        yield from (f"{each.name}: {each.text}" for each in self.shares)
        yield f"{CHANCE}: {physics_chance(self.outcomes):.2g}"
        yield f"{LAPSE}: {self.odds_ratio}"
        yield from stated_lines(self.stated)
        yield from (f"real: {each}" for each in stated_lines(self.stated_real))


def score_setup(work: Path, names: Sequence[str], results: Path) -> SetupScore:
    """Judges all cases and writes setup.md and setup.json."""
    outcomes = [_judge(work, name) for name in names]
    shares = _measure(outcomes)
    score = SetupScore(shares, outcomes)
    rows = [*((each.name, each.text) for each in shares), (CHANCE, f"{physics_chance(outcomes):.2g}")]
    rows.append((LAPSE, score.odds_ratio))
    missed = [
        (each.source, each.kind, "; ".join(each.mistakes), str(each.seen), "; ".join(each.named) or each.status)
        for each in outcomes
        if each.false or not all(right or not seen for right, seen in zip(each.right, each.seen, strict=True))
    ]
    heads = ("source", "kind", "true", "can be seen", "said")
    page = markdown_page(
        "How recordings are read: score",
        markdown_table(("measure", "value"), rows),
        HEADING,
        "Setup findings of all sources, then those of real recordings alone.",
        stated_table(score.stated),
        stated_table(score.stated_real),
        "## Misses and false corrections",
        markdown_table(heads, missed) if missed else "None.",
    )
    content = json.dumps([asdict(each) for each in outcomes], indent=1) + "\n"
    write_texts({"setup.md": page, SETUP_FILE: content}, results)
    return score


def read_setup_measures(folder: Path) -> dict[str, list[Measure]]:
    """The measures that all tiers have, of simulated and of real recordings, from setup.json in a folder."""
    cases = json.loads((folder / SETUP_FILE).read_text(encoding="utf-8"))
    outcomes = TypeAdapter(list[SetupOutcome]).validate_python(cases)
    out = {}
    for name in ("simulated", "real"):
        own = [each for each in outcomes if (each.source == "real") == (name == "real")]
        nulls = [each.false > 0 for each in own if each.source == "null"]
        seen = [right for each in own for right, sight in zip(each.right, each.seen, strict=True) if sight]
        out[name] = [
            share_measure("false_claims_on_nulls", pd.Series(nulls, dtype=bool)),
            replace(share_measure("right_name_or_class", pd.Series(seen)), wanted=NAMES_WANTED["setup"]),
            *stated_measures([claim for each in own for claim in each.stated]),
        ]
    return out


def _measure(outcomes: Sequence[SetupOutcome]) -> list[Share]:
    out = []
    for source in ("simulated", "real"):
        own = [each for each in outcomes if each.source == source]
        seen = [right for each in own for right, sight in zip(each.right, each.seen, strict=True) if sight]
        unseen = [sight for each in own for sight in each.seen]
        out.append(Share(f"{source}: named rightly, of those that can be seen", sum(seen), len(seen)))
        out.append(Share(f"{source}: can be seen", sum(unseen), len(unseen)))
        out.append(Share(f"{source}: cases with a false setup finding", sum(each.false > 0 for each in own), len(own)))
    found = [each.gravity_off for each in outcomes if each.gravity_off is not None]
    near = f"direction of gravity within {GRAVITY_DEG:g} degrees, where it is found"
    out.append(Share(near, sum(off <= GRAVITY_DEG for off in found), len(found)))
    nulls = [each for each in outcomes if each.source == "null"]
    out.append(Share("nothing wrong: cases with a setup finding", sum(each.false > 0 for each in nulls), len(nulls)))
    for name, (hits, total) in _physics(outcomes).items():
        out.append(Share(f"hidden physics named, {name}", hits, total))
    return out


def _physics(outcomes: Sequence[SetupOutcome]) -> dict[str, tuple[int, int]]:
    """How many hidden effects are named, and how many there are, beside a mistake and alone."""
    groups = {
        "beside a mistake": [each for each in outcomes if each.mistakes],
        "alone": [each for each in outcomes if each.source == "null"],
    }
    return {
        name: (sum(each.physics_right for each in own), sum(each.physics for each in own))
        for name, own in groups.items()
    }


def physics_chance(outcomes: Sequence[SetupOutcome]) -> float:
    """How probable it is that names beside a mistake differ by so much from those alone by chance (Fisher 1935)."""
    table = [(hits, total - hits) for hits, total in _physics(outcomes).values()]
    return float(fisher_exact(table).pvalue)


def _judge(work: Path, name: str) -> SetupOutcome:
    truth = json.loads((work / "truth" / f"{name}.json").read_text(encoding="utf-8"))
    folder = work / "verdicts" / name
    refused = read_complaint(folder)
    verdict = {} if refused else json.loads((folder / "verdict.json").read_text(encoding="utf-8"))
    findings = verdict.get("findings", [])
    setup = [each for each in findings if each.get("kind") == "setup"]
    true = [_label(each) for each in truth["mistakes"]]
    classes = [_class_of(each) for each in setup]
    single = truth["arm_joints"] == 1
    right = [any(_is_named(each, members, single) for members in classes) for each in truth["mistakes"]]
    false = sum(not any(_is_named(each, members, single) for each in truth["mistakes"]) for members in classes)
    named = [[each["effect"], each["joint"]] for each in findings if each.get("kind") != "setup"]
    return SetupOutcome(
        case=name,
        source=truth["source"],
        kind=truth["kind"],
        mistakes=true,
        seen=truth["seen"],
        named=[", ".join(f"{effect}@{place}" for effect, place in members) for members in classes],
        right=right,
        false=false,
        status=refused or verdict.get("status", ""),
        physics=len(truth["physics"]),
        physics_right=sum(each in named for each in truth["physics"]),
        gravity_off=_gravity_off(truth, setup),
        stated=[_stated(finding, truth["mistakes"], single) for finding in setup],
    )


def _stated(finding: dict[str, Any], mistakes: Sequence[dict[str, Any]], single: bool) -> StatedClaim:
    """A setup finding. single: an arm of one joint, where all joints are that joint.

    The claim is right where its name is, or one that counts as it; so is its probability of all of these together.
    """
    own = [(finding["effect"], _place(finding["joint"], finding.get("joints") or []))]
    right, in_class = (any(_is_named(each, names, single) for each in mistakes) for names in (own, _class_of(finding)))
    chance = finding.get("probability")
    if chance is None:
        return StatedClaim(finding["effect"], None, right, in_class)
    rivals = (finding.get("class") or [])[1:]
    # a class leaves out the form; of a direction, that of the position is the one that fits alike
    alike = [each for each in rivals if _is_named({**each, "joints": [], "form": "position"}, own, single)]
    together, all_names = (chance + sum(each["probability"] for each in names) for names in (alike, rivals))
    return StatedClaim(finding["effect"], together, right, in_class, all_names)


def _gravity_off(truth: dict[str, Any], setup: Sequence[dict[str, Any]]) -> float | None:
    found = [each["parameters"]["gravity"]["value"] for each in setup if each["effect"] == "base_tilt"]
    if not found or not any(each["effect"] == "base_tilt" for each in truth["mistakes"]):
        return None
    case = SetupCase(*(truth[field.name] for field in fields(SetupCase)))
    one, other = (np.array(each) / np.linalg.norm(each) for each in (found[0], case.right_gravity))
    return float(np.rad2deg(2 * np.arctan2(np.linalg.norm(one - other), np.linalg.norm(one + other))))


def _class_of(finding: dict[str, Any]) -> list[tuple[str, str]]:
    """Effects and places of a finding and of its class, of three names at most; none of a larger one."""
    members = finding.get("class") or [finding]
    if len(members) > MAX_CLASS:
        return []
    own = (finding["effect"], _place(finding["joint"], finding.get("joints") or []))
    return [own, *((each["effect"], _place(each["joint"], [])) for each in members)]


def _is_named(true: dict[str, Any], members: list[tuple[str, str]], single: bool) -> bool:
    """Whether a class holds a mistake. single: an arm of one joint, where all joints are that joint."""
    names = [true["effect"]]
    if true["effect"] == "torque_sign":
        names.append("joint_direction")
    if true["effect"] == "joint_direction" and true["form"] == "position":
        names.append("torque_sign")
    if single and true["effect"] in ("time_delay", "channel_skew"):
        names += ["time_delay", "channel_skew"]
    place = _place(true["joint"], true["joints"])
    return any(
        effect in names and (where == place or (single and {where, place} <= {"-", "1"})) for effect, where in members
    )


def _place(joint: int | None, joints: Sequence[int]) -> str:
    return ",".join(map(str, joints)) if len(joints) > 1 else "-" if joint is None else str(joint)


def _label(mistake: dict[str, Any]) -> str:
    place = _place(mistake["joint"], mistake["joints"])
    size = f" {mistake['size']:.3g}" if mistake["size"] else ""
    return f"{mistake['effect']}@{place} {mistake['form']}{size}".strip()
