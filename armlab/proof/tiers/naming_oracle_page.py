"""The table of the naming oracle: what anyone could name, effect by effect, and what the diagnosis named."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import pandas as pd
from joblib import Parallel, delayed

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.streams import named_generator
from armlab.proof.blind.folders import claim_folder
from armlab.proof.blind.naming_oracle import OracleAnswer, ask_oracle
from armlab.proof.blind.score.distance import ORACLE_PAGE, ORACLE_TABLE, format_share, join_with_score
from armlab.proof.blind.score.measures import MIN_NAMED_MULTIPLE
from armlab.proof.blind.score.rows import read_table
from armlab.proof.blind.score.scoring import SCORE_FILE
from armlab.proof.blind.sizing import simulate_case
from armlab.proof.tiers.torque import SetSettings


def read_scored_effects(settings: SetSettings, score: Path) -> pd.DataFrame:
    """The table of hidden effects in the folder of a score. Raises InputError unless it is that of the set."""
    try:
        found = json.loads((score / SCORE_FILE).read_text(encoding="utf-8"))
        seed, cases, effects = found["seed"], found["cases"], read_table(score / "effects.csv")
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{score} holds no whole score ({error}): {SCORE_FILE} and effects.csv are needed") from None
    if (seed, cases) != (settings.seed, settings.cases):
        raise InputError(f"{score} is the score of another set: seed {seed}, {cases} cases")
    return effects


def draw_cases(settings: SetSettings, count: int) -> list[int]:
    """Numbers of so many cases of a set, drawn at random; those of a smaller count are among those of a larger one."""
    order = named_generator("cases for the oracle", settings.seed).permutation(settings.cases)
    return sorted(order[:count].tolist())


def ask_about_set(settings: SetSettings, numbers: Sequence[int], work: Path, jobs: int) -> Iterator[str]:
    """Asks the oracle about cases of a set that have no answer in the folder `work`; yields the name of each.

    Raises InputError for a folder of another set.
    """
    claim_folder(settings, work)
    missing = [number for number in numbers if not _answer_file(settings, number, work).is_file()]
    asked = (delayed(_ask_about_case)(settings, number, work) for number in missing)
    yield from Parallel(n_jobs=jobs, return_as="generator_unordered")(asked)


def collect_answers(settings: SetSettings, numbers: Sequence[int], work: Path) -> list[OracleAnswer]:
    """What the oracle says of the effects of cases of a set that are expected to be named."""
    files = [_answer_file(settings, number, work) for number in numbers]
    return [OracleAnswer(**each) for file in files for each in json.loads(file.read_text(encoding="utf-8"))]


def _ask_about_case(settings: SetSettings, number: int, work: Path) -> str:
    plan, file = settings.plan(number), _answer_file(settings, number, work)
    hides_nothing = plan.kind in ("null", "decoy")
    answers = [] if hides_nothing else [asdict(each) for each in ask_oracle(simulate_case(plan), MIN_NAMED_MULTIPLE)]
    write_texts({file.name: json.dumps(answers) + "\n"}, work)
    return plan.name


def _answer_file(settings: SetSettings, number: int, work: Path) -> Path:
    return work / f"{settings.plan(number).name}.json"


def write_oracle(
    answers: Sequence[OracleAnswer], asked: tuple[int, int], effects: pd.DataFrame | None, out: Path
) -> tuple[Path, ...]:
    """Writes oracle.csv and oracle.md.

    asked: number of cases that were asked, of the set. effects: what a diagnosis named of the same set, see
    `read_scored_effects`.

    Raises InputError for effects of another set.
    """
    columns = [field.name for field in fields(OracleAnswer)]
    table = pd.DataFrame([asdict(each) for each in answers], columns=columns)
    known = table if effects is None else join_with_score(table, effects)
    sections = [
        part
        for tier in sorted(set(known["tier"]))
        for part in (f"## {tier.capitalize()} tier", _effects_table(known[known["tier"] == tier]))
    ]
    page = markdown_page(
        "How far could anyone get?",
        f"{'All' if asked[0] == asked[1] else f'{asked[0]}, drawn at random, of the'} {asked[1]} cases of the set were "
        f"asked about. Effects above {MIN_NAMED_MULTIPLE:g} detection limits, which are those of an observer who knows "
        "the motion. "
        "*Limits, recorded*: their median for one who has positions as the encoders round them; *away from reversals*: "
        "for one who has nothing within 25 ms of a reversal of each joint. *Oracle*: what such an observer (with all "
        "rows) names who knows the noise and the equations of all laws, of the library and outside it. *Diagnosis*: "
        "what was named blindly; outside the library, what was called unknown. *Hardest*: the law that is nearest most "
        "often, and the median distance from it in standard deviations.",
        *sections,
    )
    return write_texts({ORACLE_TABLE: table.to_csv(index=False), ORACLE_PAGE: page}, out)


def _effects_table(table: pd.DataFrame) -> str:
    heads = [
        "effect",
        "cases",
        "limits, recorded",
        "away from reversals",
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
        parts = [(name, whole), (f"{name}, above {limits}", whole[above]), (f"{name}, below {limits}", whole[~above])]
        far = whole["multiple_away"] > MIN_NAMED_MULTIPLE
        parts += [
            (f"{name}, {side} {MIN_NAMED_MULTIPLE:g} limits away from reversals", whole[chosen])
            for side, chosen in (("above", far), ("below", ~far))
        ]
        rows += [_row(f"**{part}**", own) for part, own in parts if len(own)]
    return markdown_table(heads, rows)


def _row(name: str, own: pd.DataFrame) -> tuple[str, ...]:
    def share(column: str) -> str:
        return format_share(own[column]) if column in own else "-"

    hardest = str(own["rival"].mode()[0]).replace("_", " ")
    return (
        name,
        str(len(own)),
        *(f"{own[column].median():.1f}" for column in ("multiple_recorded", "multiple_away")),
        *(share(column) for column in ("right_name", "right_class", "named_first", "named_class")),
        f"{hardest}, {own['distance'].median():.1f}",
    )
