"""How sure a finding may be that no effect of the library is it: a limit from judged sets, and what it does to scores.

The weights of names are learnt from findings whose right answer is among their answers. A finding may have none:
chance, or a law of the library in a form that is no candidate. `unknown` is then the likeliest answer, or the only one,
and wrong. So it is no surer than such findings were right in judged sets of earlier engines, which judge no more.
"""

import json
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.score.cases import UNKNOWN_NAME
from armlab.proof.blind.score.measures import Measure, is_right_name, reliability_measures
from armlab.proof.blind.score.rows import CLAIM_COLUMNS, read_table
from armlab.proof.blind.score.score_page import format_measure

LIMIT_FILE, LIMIT_SCHEMA, PAGE_FILE = "unknown_limit.json", "unknown-limit/1", "unknown.md"
DIGITS = 4
SURE = 0.7  # a probability; findings that were `unknown` with this or more are counted
SCORES = ("brier_skill", "log_skill")


@dataclass(frozen=True)
class UnknownLimit:
    """The limit, from how many findings were `unknown` with a probability of `SURE` or more, and rightly so."""

    findings: int
    right: int

    @property
    def value(self) -> float:
        """The probability that the next one is right, by the rule of succession (Laplace 1774)."""
        return round((self.right + 1) / (self.findings + 2), DIGITS)


@dataclass(frozen=True, eq=False)
class JudgedClaims:
    """The claims of a judged set. name: of the set; claims: as in its `claims.csv`."""

    name: str
    claims: pd.DataFrame

    @property
    def unknown(self) -> "pd.Series[bool]":
        """Which of them have no name, and a probability."""
        return (self.claims["effect"] == UNKNOWN_NAME) & self.claims["probability"].notna()


@dataclass(frozen=True)
class LimitedScore:
    """Scores of the probabilities of a tier, as they were stated and with a limit that its set did not make.

    checked: whether the set has no part in the limit that is shipped, either.
    """

    name: str
    tier: str
    limit: float
    checked: bool
    stated: dict[str, Measure]
    limited: dict[str, Measure]


def read_claims(path: Path) -> JudgedClaims:
    """The `claims.csv` of a judged set, which has the name of the file; InputError where it is none."""
    try:
        claims = read_table(path)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot read {path}: {error}") from None
    missing = [each for each in CLAIM_COLUMNS if each not in claims.columns]
    if missing:
        raise InputError(f"{path} should be the claims.csv of a score: it lacks the columns {', '.join(missing)}")
    return JudgedClaims(path.stem, claims)


def limit_of(sets: Sequence[JudgedClaims]) -> UnknownLimit:
    """The limit by the findings without a name of some sets."""
    own = [each.claims[each.unknown & (each.claims["probability"] >= SURE)] for each in sets]
    return UnknownLimit(sum(map(len, own)), sum(int(is_right_name(each).sum()) for each in own))


def check_limit(learnt: Sequence[JudgedClaims], unseen: Sequence[JudgedClaims]) -> list[LimitedScore]:
    """What a limit does to the scores of each tier of each set; that of a learnt set is made by the others."""
    if len(learnt) < 2:
        raise InputError("give the claims of two judged sets or more, so that each can be left out in turn")
    out = []
    for each in (*learnt, *unseen):
        limit = limit_of([other for other in learnt if other is not each]).value
        for tier in sorted(set(each.claims["tier"])):
            own = (each.claims["tier"] == tier) & (each.claims["category"] != "background")
            stated, unknown = each.claims[own], each.unknown[own]
            limited = stated.assign(probability=stated["probability"].mask(unknown, _at_most(stated, limit)))
            scores = [_scores(claims) for claims in (stated, limited)]
            out.append(LimitedScore(each.name, tier, limit, each in unseen, *scores))
    return out


def _at_most(claims: pd.DataFrame, limit: float) -> "pd.Series[float]":
    return claims["probability"].clip(upper=limit)


def _scores(claims: pd.DataFrame) -> dict[str, Measure]:
    return {each.id: each for each in reliability_measures(claims) if each.id in SCORES}


def write_limit(learnt: Sequence[JudgedClaims], scores: Sequence[LimitedScore], out: Path) -> tuple[Path, ...]:
    """Writes the limit, which the diagnosis reads, and a page about it."""
    limit, names = limit_of(learnt), [each.name for each in learnt]
    content = {"schema": LIMIT_SCHEMA, "sets": names, **asdict(limit), "limit": limit.value}
    page = markdown_page(
        "How sure `unknown` may be",
        f"{limit.right} of {limit.findings} findings without a name whose probability was {SURE:g} or more were right "
        f"in the judged sets of the commits {', '.join(names)}. So the limit is {limit.value:.2f}.",
        "Scores of the probabilities of claims beyond background, against the base rate, as they were stated and with "
        "a limit made by the other sets. A set that is marked has no part in the limit that is shipped.",
        markdown_table(
            ("set", "tier", "limit", "Brier skill", "with the limit", "log skill", "with the limit"),
            [_row(each) for each in scores],
        ),
    )
    return write_texts({LIMIT_FILE: json.dumps(content, indent=1) + "\n", PAGE_FILE: page}, out)


def _row(score: LimitedScore) -> tuple[str, ...]:
    figures = [format_measure(own[each]) for each in SCORES for own in (score.stated, score.limited)]
    return (f"{score.name} (marked)" if score.checked else score.name, score.tier, f"{score.limit:.2f}", *figures)


def limit_lines(scores: Sequence[LimitedScore]) -> list[str]:
    """What the limit does to the log skill, a line a tier of a set, for the terminal."""
    return [
        f"{each.name}, {each.tier}: log skill {format_measure(each.stated['log_skill'])}, "
        f"with the limit {format_measure(each.limited['log_skill'])}"
        for each in scores
    ]
