"""How far a score is from what anyone could name: the table that the oracle of names wrote beside it."""

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.markdown import markdown_table
from armlab.proof.blind.score.measures import MEASURE_TEXTS, MIN_NAMED_MULTIPLE

ORACLE_TABLE, ORACLE_PAGE = "oracle.csv", "oracle.md"
KEYS = ["case", "tier", "effect", "joint"]
WHOLE_ARM = 0  # in the place of a joint, so that tables can be joined
SHARES = {  # of effects above three limits: measure, whether outside the library, of the diagnosis, of the oracle
    "right_name": (False, "named_first", "right_name"),
    "right_name_or_class": (False, "named_class", "right_class"),
    "unknown_outside": (True, "named_first", "right_name"),
}
HOW_TO_READ_DISTANCES = (
    "*Oracle*: what an observer would name of the same effects who knows the noise and the equations of all laws, and "
    "has positions as the encoders round them ([effect by effect](oracle.md)). *Below*: share of the effects that are "
    f"smaller than {MIN_NAMED_MULTIPLE:g} limits for this observer."
)


def read_oracle_table(folder: Path, effects: pd.DataFrame) -> pd.DataFrame | None:
    """The oracle's table in the folder of a score beside what was named; None where there is none.

    effects: those of the score. Raises InputError for the table of another set.
    """
    path = folder / ORACLE_TABLE
    if not path.is_file():
        return None
    return join_with_score(pd.read_csv(path, dtype={"case": str}), effects)


def join_with_score(table: pd.DataFrame, effects: pd.DataFrame) -> pd.DataFrame:
    """The oracle's rows with what was named of each effect. Raises InputError where they are of different sets."""
    tables = [each.assign(joint=each["joint"].fillna(WHOLE_ARM).astype(int)) for each in (table, effects)]
    joined = tables[0].merge(tables[1][[*KEYS, "named_first", "named_class"]], on=KEYS, how="left")
    if joined["named_first"].isna().any():
        raise InputError("the oracle and the score are of different sets: give --seed, --tier and --cases of the score")
    return joined


def remove_oracle(folder: Path) -> None:
    """Removes what the oracle wrote beside an earlier score."""
    for name in (ORACLE_TABLE, ORACLE_PAGE):
        (folder / name).unlink(missing_ok=True)


def distance_table(known: pd.DataFrame) -> str:
    """What was named of what the oracle names, and of what it sees, in each tier. known: see `read_oracle_table`."""
    tiers = sorted(set(known["tier"]))
    heads = ["measure", *(f"{tier}: {what}" for tier in tiers for what in ("diagnosis", "oracle", "below", "of"))]
    rows = [[MEASURE_TEXTS[id].title, *_distances(known, id, tiers)] for id in SHARES]
    return markdown_table(heads, rows, numbers=range(1, len(heads)))


def _distances(known: pd.DataFrame, id: str, tiers: list[str]) -> list[str]:
    found = [Distance.of(known, id, tier) for tier in tiers]
    return [text for each in found for text in (each.diagnosis, each.oracle, each.below, str(each.number))]


@dataclass(frozen=True)
class Distance:
    """Of a share of a score in one tier, in per cent, - where nothing was asked: what was named, what the oracle names,
    what is below three limits for it, and what was named of effects that are larger than that away from reversals.
    """

    number: int
    diagnosis: str
    oracle: str
    below: str
    number_away: int
    diagnosis_away: str

    @classmethod
    def of(cls, known: pd.DataFrame, id: str, tier: str) -> "Distance":
        """known: see `read_oracle_table`. id: a key of SHARES."""
        outside, diagnosis, oracle = SHARES[id]
        own = known[(known["tier"] == tier) & (known["outside"].astype(bool) == outside)]
        away = own[own["multiple_away"] > MIN_NAMED_MULTIPLE]
        return cls(
            number=len(own),
            diagnosis=format_share(own[diagnosis]),
            oracle=format_share(own[oracle]),
            below=format_share(own["multiple_recorded"] <= MIN_NAMED_MULTIPLE),
            number_away=len(away),
            diagnosis_away=format_share(away[diagnosis]),
        )


def format_share(values: pd.Series) -> str:
    """The mean of shares or of what is true, in per cent."""
    return f"{100 * float(values.astype(float).mean()):.0f} %" if len(values) else "-"
