"""One page about the last judged run of every tier: what was wanted, and what was found.

It is made from what the tiers have written below the folder of the results. A tier that is not there has no column.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.field import field_score
from armlab.proof.blind.log_page import LOG_FILE, LOG_PAGE
from armlab.proof.blind.pairs import pair_score
from armlab.proof.blind.real.real_score import CASES_TABLE, read_tables, real_measures
from armlab.proof.blind.score.distance import SHARES, Distance, read_oracle_table
from armlab.proof.blind.score.measures import MEASURE_TEXTS, MIN_NAMED_MULTIPLE, Measure
from armlab.proof.blind.score.score_page import engines_section, format_aims, format_measure
from armlab.proof.blind.score.scoring import SCORE_FILE, read_rows
from armlab.proof.blind.score.share import share_id
from armlab.proof.blind.servo.servo_score import MOTION_FILE, read_motion_measures
from armlab.proof.blind.setup.setup_score import SETUP_FILE, read_setup_measures

SUMMARY_PAGE = "summary.md"
_SETS = {"clean": "mixed", "realistic": "mixed", "reading simulated": "setup", "reading real": "setup"}
_NULLS = "false_claims_on_nulls"
SHOWN = (
    _NULLS,
    "wrong_names_beyond_background",
    "wrong_names_of_named",
    "right_name_or_class",
    "right_joint",
    "unknown_outside",
    "left_outside",
    "right_when_doubtful",
    "right_when_likely",
    "right_when_sure",
    "stated_when_sure",
    "brier_skill",
    "log_skill",
)
TITLES = {"right_name_or_class": "right name or class, of what is large enough"}  # which differs between tiers
HOW_TO_READ = f"""\
Each cell: the value, its 95 % interval (Wilson's for shares, bootstrap for means and skills, as if claims were
independent; those of one real recording are not), and the number that it was counted on. **Bold**: the value is not
as wanted; of a bin of probabilities, its whole interval is outside the bin. Where an interval crosses the bound, the
truth may be on its other side.

- *Clean*, *realistic*: torques simulated by two engines ([score](mixed/score.md)); large enough is above
  {MIN_NAMED_MULTIPLE:g} detection limits, a class has four names at most. Nulls, with nothing hidden, are a set of
  their own, which may have been judged on another commit ([nulls](nulls/score.md)).
- *Reading*: mistakes in how a recording is read, put into simulated and real recordings ([score](setup/setup.md));
  large enough is what can be seen, a class has three names at most.
- *Motion*: commands and positions without torque ([score](motion/motion.md)), {MIN_NAMED_MULTIPLE:g} limits.
- *Real*: something known concealed in real recordings ([score](real/real.md)); three times the error of the model is
  large enough. No share of names is wanted, because this is no detection limit. Probabilities of `unknown` are not
  counted there, because nobody knows what else there is.

A *claim* is a finding; *beyond background*: without friction and wrong links that every case has. A claim is right,
too, where it names a part of what is hidden, or what no motion separates from it. A class of more than four names is
wrong. *Skill*: one less the score (Brier, or the mean of -log of the probability of what is true, which is bounded at
0.001) over the score of one constant probability, the share that was right among the same claims. Above 0 is better
than this constant. *Oracle*: what an observer would name of the same effects who knows the noise and the equations of
all laws, and has positions as encoders round them, with the number of effects that it was asked about
([effect by effect](mixed/oracle.md)). *Too small*: effects that are below {MIN_NAMED_MULTIPLE:g} limits for this
observer. *Large away from reversals*: above {MIN_NAMED_MULTIPLE:g} limits for one who has nothing within 25 ms of a
reversal of each joint.

All judged runs: [log]({LOG_PAGE})."""
Columns = Mapping[str, Mapping[str, Measure]]


def write_summary(results: Path) -> Path:
    """Writes the page into the folder of the results of a judged proof, beside its log.

    Raises InputError for a folder without a log.
    """
    if not (results / LOG_FILE).is_file():
        raise InputError(f"{results} holds no {LOG_FILE}: it should be the folder of the results of a judged proof")
    columns = {name: {each.id: each for each in measures} for name, measures in _columns(results)}
    rows = [row for id in SHOWN for row in (_row(id, columns), *_oracle_rows(id, columns, results))]
    page = markdown_page(
        "What was wanted and found",
        "The last judged run of each tier.",
        markdown_table(("measure", "wanted", *columns), [*_commit_rows(results, columns), *rows]),
        HOW_TO_READ,
        *_share_sections(results),
        *_engines(results),
    )
    (written,) = write_texts({SUMMARY_PAGE: page}, results)
    return written


def _columns(results: Path) -> Iterator[tuple[str, list[Measure]]]:
    if (results / "mixed" / SCORE_FILE).is_file():
        nulls = _torque(results / "nulls")
        for tier, measures in _torque(results / "mixed").items():
            more = {each.id: each for each in nulls.get(tier, []) if each.id == _NULLS}
            yield tier, [more.get(each.id, each) for each in measures]
    if (results / "setup" / SETUP_FILE).is_file():
        yield from ((f"reading {source}", each) for source, each in read_setup_measures(results / "setup").items())
    if (results / "motion" / MOTION_FILE).is_file():
        yield "motion", read_motion_measures(results / "motion")
    if (results / "real" / CASES_TABLE).is_file():
        yield "real", [each.measure for each in real_measures(read_tables(results / "real"))]


def _torque(folder: Path) -> dict[str, list[Measure]]:
    if not (folder / SCORE_FILE).is_file():
        return {}
    tiers = json.loads((folder / SCORE_FILE).read_text(encoding="utf-8"))["tiers"]
    return {tier: [Measure(**each) for each in found] for tier, found in tiers.items()}


def _row(id: str, columns: Columns) -> list[str]:
    found = {name: measures[id] for name, measures in columns.items() if id in measures}
    aims = format_aims(found)
    return [TITLES.get(id, MEASURE_TEXTS[id].title), aims, *(_cell(found.get(name)) for name in columns)]


def _cell(measure: Measure | None) -> str:
    if measure is None or measure.value is None:
        return "-"
    text = f"{format_measure(measure)}, {measure.number}"
    return f"**{text}**" if measure.is_met is False else text


def _oracle_rows(id: str, columns: Columns, results: Path) -> Iterator[list[str]]:
    """What the oracle names of what was asked, and what is too small for it, where it was asked."""
    folder = results / "mixed"
    if id not in SHARES or not columns.keys() & {"clean", "realistic"}:
        return
    known = read_oracle_table(folder, read_rows(folder).effects)
    if known is None:
        return
    found = [Distance.of(known, id, name) for name in columns]
    away = [f"{each.diagnosis_away}, {each.number_away}" if each.number_away else "-" for each in found]
    yield ["&nbsp;&nbsp;the oracle", "-", *(f"{each.oracle}, {each.number}" if each.number else "-" for each in found)]
    yield ["&nbsp;&nbsp;the diagnosis, of what is large away from reversals", "-", *away]
    yield ["&nbsp;&nbsp;too small", "-", *(each.below for each in found)]


def _commit_rows(results: Path, columns: Columns) -> Iterator[list[str]]:
    """The last commit that each column was judged on, and its nulls, which may be a set of their own."""
    lines = (results / LOG_FILE).read_text(encoding="utf-8").splitlines()
    last = {entry["set"]: entry["commit"][:7] for entry in map(json.loads, lines)}
    sets = {name: _SETS.get(name, name) for name in columns}
    null_sets = {
        name: "nulls" if judged == "mixed" else judged
        for name, judged in sets.items()
        if _cell(columns[name].get(_NULLS)) != "-"
    }
    yield ["commit", "-", *(last.get(sets[name], "-") for name in columns)]
    yield ["commit of the nulls", "-", *(last.get(null_sets.get(name, ""), "-") for name in columns)]


def _share_sections(results: Path) -> Iterator[str]:
    """The last judged run of the tiers that count shares alone."""
    lines = (results / LOG_FILE).read_text(encoding="utf-8").splitlines()
    last = {entry["set"]: entry for entry in map(json.loads, lines)}
    if "changes" in last:
        found = last["changes"]["score"]["changes"]
        halves = ("", ", simulated", ", field")
        rows = [
            (name, aim, *(_share_cell(found.get(share_id(f"{name}{half}"))) for half in halves))
            for name, aim in pair_score.WANTED.items()
        ]
        yield _share_heading("Pairs of recordings", last["changes"])
        yield markdown_table(("measure", "wanted", "all", "simulated", "field"), rows)
    if "field" in last:
        aims = {share_id(name): aim for name, aim in field_score.WANTED.items()}
        found = last["field"]["score"]["field"].items()
        yield _share_heading("Recordings that resemble real ones", last["field"])
        rows = [(id.replace("_", " "), aims.get(id, "-"), _share_cell(figure)) for id, figure in found]
        yield markdown_table(("measure", "wanted", "found"), rows)


def _share_heading(title: str, entry: Mapping[str, Any]) -> str:
    name, commit = entry["set"], entry["commit"][:7]
    return f"## {title}\n\nCommit {commit}, {entry['cases']} cases ([score]({name}/{name}.md))."


def _share_cell(figure: Sequence[Any] | None) -> str:
    """A share of the log: its value, its interval, and the number that it was counted on."""
    if figure is None or figure[0] is None:
        return "-"
    value, low, high, number = figure
    return f"{100 * value:.3g} % ({100 * low:.3g} to {100 * high:.3g}), {number}"


def _engines(results: Path) -> list[str]:
    """The second engine beside the first one, with the nulls of the set that has many."""
    folders = [each for each in (results / "mixed", results / "nulls") if (each / SCORE_FILE).is_file()]
    if not folders:
        return []
    tables = [read_rows(folder) for folder in folders]
    return engines_section(replace(tables[0], cases=pd.concat([each.cases for each in tables])))
