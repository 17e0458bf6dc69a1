"""The table of the naming oracle: what anyone could name, effect by effect, and what the diagnosis named."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import pandas as pd
from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.concealed.naming_oracle import OracleAnswer, ask_oracle
from armlab.concealed.score.measures import MIN_NAMED_MULTIPLE
from armlab.concealed.sets import SetSettings
from armlab.concealed.sizing import simulate_case

TABLE_FILE, PAGE_FILE = "oracle.csv", "oracle.md"
KEYS = ["case", "tier", "effect", "joint"]
WHOLE_ARM = 0  # in the place of a joint, so that tables can be joined


def ask_about_set(settings: SetSettings, jobs: int) -> Iterator[list[OracleAnswer]]:
    """What the oracle says of the effects of each case of a set that are expected to be named."""
    work = (delayed(_ask_about_case)(settings, number) for number in range(settings.cases))
    yield from Parallel(n_jobs=jobs, return_as="generator")(work)


def _ask_about_case(settings: SetSettings, number: int) -> list[OracleAnswer]:
    plan = settings.plan(number)
    if plan.kind in ("null", "decoy"):
        return []
    return list(ask_oracle(simulate_case(plan), MIN_NAMED_MULTIPLE))


def write_oracle(answers: Sequence[OracleAnswer], score: Path | None, out: Path) -> tuple[Path, ...]:
    """Writes oracle.csv and oracle.md. score: folder of the score of a diagnosis of the same set.

    Raises InputError for the score of another set.
    """
    columns = [field.name for field in fields(OracleAnswer)]
    table = pd.DataFrame([asdict(each) for each in answers], columns=columns)
    known = table if score is None else _beside_score(table, score)
    sections = [
        part
        for tier in sorted(set(known["tier"]))
        for part in (f"## {tier.capitalize()} tier", _effects_table(known[known["tier"] == tier]))
    ]
    page = markdown_page(
        "How far could anyone get?",
        f"Effects above {MIN_NAMED_MULTIPLE:g} detection limits, which are those of an observer who knows the motion. "
        "*Limits, recorded*: their median for one who has positions as the encoders round them. *Oracle*: what such an "
        "observer names who knows the noise and the equations of all laws, of the library and outside it. *Diagnosis*: "
        "what was named blindly; outside the library, what was called unknown. *Hardest*: the law that is nearest most "
        "often, and the median distance from it in standard deviations.",
        *sections,
    )
    return write_texts({TABLE_FILE: table.to_csv(index=False), PAGE_FILE: page}, out)


def _beside_score(table: pd.DataFrame, score: Path) -> pd.DataFrame:
    path = score / "effects.csv"
    if not path.is_file():
        raise InputError(f"{score} holds no score: {path.name} is expected there")
    found = pd.read_csv(path, dtype={"case": str}, keep_default_na=False, na_values=[""])
    tables = [each.assign(joint=each["joint"].fillna(WHOLE_ARM).astype(int)) for each in (table, found)]
    joined = tables[0].merge(tables[1][[*KEYS, "named_first", "named_class"]], on=KEYS, how="left")
    if joined["named_first"].isna().any():
        raise InputError(f"{score} is the score of another set: give --seed and --cases of that set")
    return joined


def _effects_table(table: pd.DataFrame) -> str:
    heads = [
        "effect",
        "cases",
        "limits, recorded",
        "oracle: name",
        "oracle: class of four",
        "diagnosis: name",
        "diagnosis: class",
        "hardest",
    ]
    groups = [(str(name), own) for name, own in table.groupby("effect")]
    rows = [_row(name.replace("_", " "), own) for name, own in groups]
    for name, whole in (("of the library", table[~table["outside"]]), ("outside the library", table[table["outside"]])):
        above = whole["multiple_recorded"] > MIN_NAMED_MULTIPLE
        limits = f"{MIN_NAMED_MULTIPLE:g} limits, recorded"
        parts = (name, whole), (f"{name}, above {limits}", whole[above]), (f"{name}, below {limits}", whole[~above])
        rows += [_row(f"**{part}**", own) for part, own in parts if len(own)]
    return markdown_table(heads, rows)


def _row(name: str, own: pd.DataFrame) -> tuple[str, ...]:
    def share(column: str) -> str:
        return f"{100 * float(own[column].astype(float).mean()):.0f} %" if column in own else "-"

    hardest = str(own["rival"].mode()[0]).replace("_", " ")
    return (
        name,
        str(len(own)),
        f"{own['multiple_recorded'].median():.1f}",
        *(share(column) for column in ("right_name", "right_class", "named_first", "named_class")),
        f"{hardest}, {own['distance'].median():.1f}",
    )
