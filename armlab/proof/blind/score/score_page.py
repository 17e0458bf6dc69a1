"""The page of a score in Markdown: wanted and found measures first, then figures, tables and misses."""

from collections.abc import Mapping
from itertools import chain
from typing import Any

import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from armlab.proof.blind.score.distance import HOW_TO_READ_DISTANCES, distance_table
from armlab.proof.blind.score.gallery import CASES_PER_GROUP, GALLERY_PAGE, tally_outcomes
from armlab.proof.blind.score.measures import (
    MEASURE_TEXTS,
    MIN_NAMED_MULTIPLE,
    Measure,
    arm_table,
    effect_table,
    engine_table,
)
from armlab.proof.blind.score.rows import ScoreRows

STRICTER_MEASURES = {  # shown below the measure that is wanted: the same, counted more strictly
    "gap_closed": "gap_closed_beyond_friction",
}
MAX_SHOWN_MISSES = 30
SHOWN_MISS_COLUMNS = ["miss", "case", "tier", "arm", "effect", "law", "joint", "limits", "hidden", "said", "why"]
HOW_TO_READ = f"""\
A *detection limit* is the size at which an oracle that knows the true law and the true noise finds the effect with 90 %
power, at a level of 1 % over all effects and places. A diagnosis that does not know the law needs more: names are
expected above {MIN_NAMED_MULTIPLE:g} limits. *Clean*: only the hidden effects differ from the simulation. *Realistic*:
every link is 3-10 % off, every joint has friction, the noise is coloured. *Null*: nothing is hidden. *Decoy*: only
links are wrong. A *claim* is a finding. A claim of something that is there is right, friction of the background
included, and so is one of a part of what is there or of what no motion separates from it (`docs/proof.md`). A class is
wrong where none of its answers is right, or where they are more than four; a first name is wrong whatever the rest of
its class is. *Skill*: one less the score of the stated probabilities (Brier, or mean -log of the probability of what is
true, bounded at 0.001) over that of one constant, the share that was right among the same claims. Intervals are 95 %:
Wilson's for shares (as if the effects of a case were independent), bootstrap for medians. *Met*: the figure is as
wanted; of a bin of probabilities, its interval reaches the bin. *Surely*: so is its whole interval (or, if not met,
none of it). *Perhaps*: the interval crosses the bound."""
HOW_ENGINES_ARE_COMPARED = (
    "Cases of the engine whose joints stick beside those of MuJoCo, without effects that have parts of their own: the "
    "second engine has none. *By chance*: probability of such a difference where both are alike (Fisher 1935)."
)
CAPTIONS = {
    "detection": "Size against share named. Bands: Wilson, 95 %; dotted: three limits.",
    "detection_by_effect": (
        "The same for each effect. Circles: clean; squares: realistic; a case that was named is at the top, one that "
        "was not at the bottom. Crosses: share, its Wilson interval, and the range of sizes of its cases."
    ),
    "confusion_clean": (
        "What was hidden and what was said, above three limits ([all sizes](confusion_clean_all.svg)). If a verdict "
        "says several things, a right name counts first, then a wrong one, then `unknown`."
    ),
    "confusion_realistic": "The same, realistic tier ([all sizes](confusion_realistic_all.svg)).",
    "names_clean": "Names by effect. To the left: how often a name was claimed wrongly, at any size.",
    "names_realistic": "The same, realistic tier.",
    "reliability": (
        "How often a claim beyond background is right, against the probability that it states. Bars: Wilson, 95 %; the "
        "number is that of the claims; on the line, probabilities hold."
    ),
    "gap": (
        "Share of the gap to the true floor that was closed on held-out runs, case by case. Right: counted from a "
        "model that has plain friction already."
    ),
    "seconds": "Run time of one diagnosis, all steps included.",
}


def render_page(
    table: ScoreRows, result: dict[str, Any], missed: pd.DataFrame, drawn: list[str], oracle: pd.DataFrame | None = None
) -> str:
    """The score of a set.

    missed: see `misses`. drawn: names of the figures, without suffix. oracle: see `read_oracle_table`.
    """
    tiers = {tier: [Measure(**each) for each in found] for tier, found in result["tiers"].items()}
    kind = "Development set, not judged." if result["development"] else "Judged set."
    seal = f"{kind} {result['cases']} cases, seed {result['seed']}, manifest SHA-256 `{result['manifest']}`."
    seal += "" if result["development"] else " All judged runs: [log](../log.md)."
    parts = [seal, "## Wanted and found", _wanted_table(tiers), HOW_TO_READ]
    if oracle is not None:
        parts += ["## How far could anyone get?", distance_table(oracle), HOW_TO_READ_DISTANCES]
    parts += [
        "## What became of each",
        tally_outcomes(table),
        f"Before and after, {CASES_PER_GROUP} of each: [{GALLERY_PAGE}]({GALLERY_PAGE}).",
    ]
    parts += ["## Figures", *(f"{text}\n\n![{name}]({name}.svg)" for name, text in CAPTIONS.items() if name in drawn)]
    parts += ["## Misses, one by one", _misses_section(missed), "## All measures", _all_measures_table(tiers)]
    parts += ["## The cases", _frame_table(_count_kinds(table)), "## By arm", _frame_table(arm_table(table))]
    parts += engines_section(table)
    for tier in tiers:
        names = effect_table(table, tier)
        if len(names):
            parts += [
                f"## By effect, {tier} tier",
                f"Above {MIN_NAMED_MULTIPLE:g} limits; wrong claims at any size.",
                _frame_table(names),
            ]
    return markdown_page("Score on concealed effects", *parts)


def engines_section(table: ScoreRows) -> list[str]:
    """The second engine beside the first one; nothing where there is no case of it."""
    engines = engine_table(table)
    return ["## Second engine", HOW_ENGINES_ARE_COMPARED, _frame_table(engines)] if len(engines) else []


def format_measure(each: Measure) -> str:
    """A figure with its interval, shares in per cent."""
    if each.value is None:
        return "-"
    scale, unit = (100, " %") if each.unit == "share" else (1, f" {each.unit}".rstrip())
    text = f"{scale * each.value:.3g}{unit}"
    if each.low is None or each.high is None:
        return text
    return f"{text} ({scale * each.low:.3g} to {scale * each.high:.3g})"


def judge_measure(each: Measure) -> str:
    """Whether a figure is as wanted, and whether this holds for its whole interval."""
    if each.is_met is None:
        return "-"
    text = "met" if each.is_met else "**not met**"
    if each.wanted == "none":
        return text
    return f"{text}, {'surely' if each.is_certain else 'perhaps'}"


def _frame_table(table: pd.DataFrame) -> str:
    rows = (tuple(map(_format_cell, row)) for row in table.itertuples(index=False))
    return markdown_table(tuple(map(_format_cell, table.columns)), rows)


def _format_cell(value: Any) -> str:
    if value is None or value is pd.NA or (isinstance(value, float) and pd.isna(value)):
        return ""
    return f"{value:.3g}" if isinstance(value, float) else str(value).replace("_", " ")


def _wanted_table(tiers: dict[str, list[Measure]]) -> str:
    """The measures that have to reach something, and their stricter companions, the tiers side by side."""
    rows = []
    for id, text in MEASURE_TEXTS.items():
        if text.wanted:
            rows.append(_wanted_row(id, "", tiers))
            if id in STRICTER_MEASURES:
                rows.append(_wanted_row(STRICTER_MEASURES[id], "&nbsp;&nbsp;", tiers))
    headings = ["measure", "wanted", *chain.from_iterable((tier, "of", "") for tier in tiers)]
    return markdown_table(headings, rows, numbers=range(3, len(headings), 3))


def _wanted_row(id: str, indent: str, tiers: dict[str, list[Measure]]) -> list[object]:
    found = [_find_measure(measures, id) for measures in tiers.values()]
    cells = chain.from_iterable((format_measure(each), each.number, judge_measure(each)) for each in found)
    aims = format_aims(dict(zip(tiers, found, strict=True)))
    return [f"{indent}{MEASURE_TEXTS[id].title}", aims, *cells]


def format_aims(measures: Mapping[str, Measure]) -> str:
    """What is wanted of a figure in some tiers, by their names; tiers that want different things stand beside it."""
    wanted: dict[str, list[str]] = {}
    for tier, each in measures.items():
        if each.wanted:
            wanted.setdefault(each.wanted, []).append(tier)
    alike = len(wanted) < 2
    return "; ".join(aim if alike else f"{aim} ({', '.join(tiers)})" for aim, tiers in wanted.items()) or "-"


def _all_measures_table(tiers: dict[str, list[Measure]]) -> str:
    rows = []
    for id, text in MEASURE_TEXTS.items():
        found = [_find_measure(measures, id) for measures in tiers.values()]
        rows.append([text.title, *chain.from_iterable((format_measure(each), each.number) for each in found)])
    headings = ["measure", *chain.from_iterable((tier, "of") for tier in tiers)]
    return markdown_table(headings, rows, numbers=range(2, len(headings), 2))


def _find_measure(measures: list[Measure], id: str) -> Measure:
    unknown = Measure(id, None, None, None, 0, MEASURE_TEXTS[id].wanted)  # of a score that is older than the measure
    return next((each for each in measures if each.id == id), unknown)


def _count_kinds(table: ScoreRows) -> pd.DataFrame:
    """How many cases of each kind and tier."""
    counts = pd.crosstab(table.cases["kind"], table.cases["tier"])
    return counts.reset_index()


def _misses_section(missed: pd.DataFrame) -> str:
    if not len(missed):
        return "None."
    more = f"The first {MAX_SHOWN_MISSES} of {len(missed)}" if len(missed) > MAX_SHOWN_MISSES else f"All {len(missed)}"
    text = (
        f"{more}. Effect and joint are what was missed or wrongly claimed. *Hidden* and *said* describe the whole "
        "case without right findings of the background. *Why* is the last that the diagnosis did with a missed "
        "effect. Noise, gap closed and all sizes are in [misses.csv](misses.csv)."
    )
    return f"{text}\n\n{_frame_table(missed.head(MAX_SHOWN_MISSES)[SHOWN_MISS_COLUMNS])}"
