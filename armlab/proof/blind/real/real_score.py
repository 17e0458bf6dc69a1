"""Measures of random cases of real recordings, from the tables that `armlab proof real-concealed --judge` writes.

The reliability of probabilities and the shares are counted by the functions that score the simulated tiers.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pandas as pd

from armlab.common.errors import InputError
from armlab.proof.blind.score.measures import (
    MEASURE_TEXTS,
    Measure,
    is_wrong_first_name,
    is_wrong_name,
    reliability_measures,
    reliability_table,
    share_measure,
)
from armlab.proof.blind.score.rows import ScoreRows
from armlab.proof.blind.score.score_page import format_measure

CASES_TABLE, CLAIMS_TABLE, RECORDINGS_TABLE = "cases.csv", "claims.csv", "recordings.csv"
MIN_STRENGTH = 3.0  # of cases that are expected to be named
STRENGTH_BINS = {"below 1": (0.0, 1.0), "1 to 3": (1.0, MIN_STRENGTH), "3 and more": (MIN_STRENGTH, float("inf"))}
CATEGORIES = {"right": "injected", "class": "wrong", "law": "law", "unknown": "unknown", "wrong": "wrong"}
NAMES_JUDGED = ("right", "class", "wrong")  # verdicts on claims that state the probability of a name
SKILLS = ("brier_skill", "log_skill")
ANSWERS = {
    "named": "named",
    "class": "in a class of four",
    "law": "another law of friction",
    "unknown": "unknown at its joint",
    "another name": "another name",
    "missed": "missed",
    "cancelled": "takes away what the control names",
    "absorbed": "held by a law that the control names",
}
UNJUDGED_ANSWERS = ("cancelled", "absorbed")  # where no new name is to be expected
TIER = "real"
TITLES = {  # of measures that mean something else here than in a simulated tier
    "right_name_or_class": f"named, or in a class of four, strength {MIN_STRENGTH:g} and more",
    "right_name": f"named first, strength {MIN_STRENGTH:g} and more",
    "right_name_all_sizes": "named first, all strengths",
    "wrong_names_beyond_background": "wrong names among new claims",
    "wrong_first_names": "new findings whose first name is wrong, classes included",
    "missing_verdicts": "cases without a diagnosis",
}


@dataclass(frozen=True, eq=False)
class RealTables:
    """A row for each thing sought, each new claim, and each recording; see `armlab proof real-concealed --judge`."""

    cases: pd.DataFrame
    claims: pd.DataFrame
    recordings: pd.DataFrame

    @property
    def number(self) -> int:
        """How many cases there are."""
        return len(self.cases.drop_duplicates(["recording", "case"]))

    @property
    def judged(self) -> pd.DataFrame:
        """What was sought, where a new name is to be expected."""
        return self.cases[~self.cases["answer"].isin(UNJUDGED_ANSWERS)]

    @property
    def strong(self) -> pd.DataFrame:
        """Of these, what is strong enough to be expected."""
        return self.judged[self.judged["strength"] >= MIN_STRENGTH]

    @property
    def scored_claims(self) -> pd.DataFrame:
        """The claims as the score of simulated tiers has them."""
        verdicts = self.claims["verdict"]
        return self.claims.assign(
            tier=TIER, category=verdicts.map(CATEGORIES), class_right=verdicts.isin(["right", "class"])
        )

    @property
    def named_claims(self) -> pd.DataFrame:
        """Those of them whose name is right or wrong."""
        return self.scored_claims[self.claims["verdict"].isin(NAMES_JUDGED)]

    def of(self, recording: str) -> "RealTables":
        """The rows of one recording."""
        parts = (each[each["recording"] == recording] for each in (self.cases, self.claims, self.recordings))
        return RealTables(*parts)


def read_tables(folder: Path) -> RealTables:
    """The tables in a folder; InputError where one is missing."""
    try:
        return RealTables(*(pd.read_csv(folder / name) for name in (CASES_TABLE, CLAIMS_TABLE, RECORDINGS_TABLE)))
    except OSError as error:
        raise InputError(f"cannot read {error.filename}: `armlab proof run --tier real` writes it") from None


@dataclass(frozen=True)
class TitledMeasure:
    """A measure, and what it is called for real recordings."""

    measure: Measure

    @property
    def title(self) -> str:
        """What pages print."""
        return TITLES.get(self.measure.id, MEASURE_TEXTS[self.measure.id].title)

    @property
    def line(self) -> str:
        """For a terminal."""
        return f"  {self.title}: {format_measure(self.measure)}, of {self.measure.number}"


def real_measures(tables: RealTables) -> list[TitledMeasure]:
    """All measures. Nothing is wanted of the share that is named: the strength is no detection limit."""
    strong, named = tables.strong, [answer_is_named(each) for each in (tables.strong, tables.judged)]
    claims, cases = tables.scored_claims, tables.cases.drop_duplicates(["recording", "case"])
    measures = [
        _unwanted(share_measure("right_name_or_class", answer_is_right(strong))),
        _unwanted(share_measure("right_name", named[0])),
        _unwanted(share_measure("right_name_all_sizes", named[1])),
        share_measure("wrong_names_beyond_background", is_wrong_name(claims)),
        share_measure("wrong_names_of_named", is_wrong_name(tables.named_claims)),
        share_measure("wrong_first_names", is_wrong_first_name(tables.named_claims)),
        *_reliability(tables.named_claims),
        share_measure("missing_verdicts", cases["refused"].notna()),
    ]
    return [TitledMeasure(each) for each in measures]


def answer_is_named(cases: pd.DataFrame) -> "pd.Series[Any]":
    """Which things were named first."""
    return cases["answer"] == "named"


def answer_is_right(cases: pd.DataFrame) -> "pd.Series[Any]":
    """Which things were named, or in a class of four."""
    return cases["answer"].isin(["named", "class"])


def _reliability(claims: pd.DataFrame) -> list[Measure]:
    """Reliability and skills; a base rate of 0 or 1 is right of itself, and no skill is counted against it."""
    measures = reliability_measures(claims)
    if claims["verdict"].eq("right").nunique() == 2:
        return measures
    return [replace(each, value=None, low=None, high=None) if each.id in SKILLS else each for each in measures]


def _unwanted(measure: Measure) -> Measure:
    return replace(measure, wanted="")


def reliability_of(tables: RealTables) -> pd.DataFrame:
    """A row a bin of the stated probability of new names: mean, share that is right, its interval, number."""
    empty = pd.DataFrame()
    return reliability_table(ScoreRows(empty, empty, tables.named_claims, empty), TIER)


def recording_table(tables: RealTables) -> pd.DataFrame:
    """A row a recording, so that a reader sees whether one spoils a figure."""
    out = []
    for name in tables.recordings["recording"]:
        own = tables.of(name)
        named = own.named_claims
        right = (named["verdict"] == "right").mean() if len(named) else None
        out.append(
            {
                "recording": name,
                "cases": own.number,
                f"sought, strength {MIN_STRENGTH:g} and more": len(own.strong),
                "named or in a class": int(answer_is_right(own.strong).sum()),
                "new claims": len(own.claims),
                "wrong names": int(is_wrong_name(own.scored_claims).sum()),
                "names with a probability": len(named),
                "stated, mean": float(named["probability"].mean()) if len(named) else None,
                "right, share": None if right is None else float(right),
            }
        )
    return pd.DataFrame(out)


def kind_table(tables: RealTables) -> pd.DataFrame:
    """A row a kind of what was concealed."""
    out = []
    for (way, kind), cases in tables.cases.groupby(["way", "kind"], sort=True):
        strong = tables.strong.loc[tables.strong.index.intersection(cases.index)]
        keys = cases[["recording", "case"]].drop_duplicates()
        claims = tables.scored_claims.merge(keys, on=["recording", "case"])
        out.append(
            {
                "concealed": f"{kind} ({way})",
                "sought": len(cases),
                f"strength {MIN_STRENGTH:g} and more": len(strong),
                "named or in a class": int(answer_is_right(strong).sum()),
                "wrong names": int(is_wrong_name(claims).sum()),
            }
        )
    return pd.DataFrame(out)


def answer_table(tables: RealTables) -> pd.DataFrame:
    """How often each answer was given, by strength."""
    out = []
    for answer, words in ANSWERS.items():
        own = tables.cases[tables.cases["answer"] == answer]["strength"]
        counts = {name: int(((own >= low) & (own < high)).sum()) for name, (low, high) in STRENGTH_BINS.items()}
        out.append({"answer": words, **counts, "all": len(own)})
    return pd.DataFrame(out)
