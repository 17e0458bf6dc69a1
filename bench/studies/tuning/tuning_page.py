"""What tuning changed: tables of the configurations and of the judged runs, and the page that says who wins then."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from bench.printed import display_name
from bench.statistics.pairwise import Duel
from bench.statistics.power import power_text
from bench.studies.tuning.judged import SUBJECT, TUNED, JudgedRuns, ProblemDuels, count_wins, duel_sign, duels_by_rival
from bench.studies.tuning.parameter_search import Tuned, params_text


@dataclass(frozen=True, eq=False)
class TuningOutcome:
    """What tuning found for each algorithm, and its judged runs; known: best condition numbers by problem."""

    tuned: tuple[Tuned, ...]
    runs: JudgedRuns
    known: Mapping[str, float]


def configurations_table(tuned: Sequence[Tuned]) -> pd.DataFrame:
    """One row a configuration that was tried: algorithm, number, loss and hyper-parameters."""
    rows = [
        {"algorithm": one.algorithm, "number": number, "loss": tried.loss, "params": params_text(tried.params)}
        for one in tuned
        for number, tried in enumerate(one.configurations)
    ]
    return pd.DataFrame(rows)


_FOUND_HEADINGS = ["algorithm", "loss", "place of the published", "hyper-parameters", "importance"]
_READING = """\
Every algorithm had the same tuning budget, on the same training problems and with the same random numbers; the first
configuration of each is the published one. Loss: average over the training problems of log10 of the median end over
that of the published configuration. Nothing below is measured on a training problem: medians, ranks and duels are of
the judging problems, which took no part in the tuning, in no frame of coordinates. An infeasible end counts as
infinite. Duels: paired Wilcoxon on log10 of the ends, Holm within a problem, 5 %."""
_SWEEP_READING = """\
All other hyper-parameters as published. In brackets the duels with the other algorithms that this value wins and loses,
first as published, then as tuned (Holm over all values and rivals within a problem). The last lines are the least
medians of the others. The limit is read off the problems that judge it, so a win here is an upper bound."""


def tuning_page(judged: TuningOutcome) -> str:
    """The tables and their verdict as a Markdown page."""
    settings = judged.runs.settings
    effort = (
        f"{settings.configurations} configurations an algorithm x {len(settings.train)} problems x "
        f"{settings.train_repetitions} repetitions of {settings.evaluations} evaluations; judged on "
        f"{len(settings.judge)} problems with {settings.judge_repetitions} repetitions. All settings: "
        f"`{settings.name}.settings.yaml`; every judged end: `{settings.name}_ends.csv`; every duel with its A12 and "
        f"95 % interval: `{settings.name}_duels.csv`."
    )
    sections = [
        "## What tuning found",
        markdown_table(_FOUND_HEADINGS, _found_rows(judged)),
        "## Medians on the problems that took no part",
        _medians_table(judged),
        *_verdict(judged.runs),
        f"![Ranks on the judging problems]({settings.name}_ranking.svg)",
        *_sweep_section(judged.runs),
    ]
    return markdown_page(settings.name, _READING, effort, *sections)


def _found_rows(judged: TuningOutcome) -> Iterator[list[str]]:
    for one in judged.tuned:
        losses = sorted(tried.loss for tried in one.configurations)
        place = losses.index(one.configurations[0].loss) + 1
        shares = sorted(one.importance.items(), key=lambda item: -item[1])
        importance = ", ".join(f"{name} {share:.2f}" for name, share in shares)
        yield [
            display_name(one.algorithm),
            f"{one.best.loss:.3f}",
            f"{place} of {len(losses)}",
            params_text(one.best.params),
            importance,
        ]


def _medians_table(judged: TuningOutcome) -> str:
    runs = judged.runs
    table, signs = runs.medians(), _signs(runs.tuning_duels())
    rows = []
    for name in runs.settings.algorithms:
        before, after = table.loc[name], table.loc[f"{name}{TUNED}"]
        cells = [
            f"{before[problem]:.3g} -> {after[problem]:.3g}{signs[problem, name]}" for problem in runs.settings.judge
        ]
        rows.append([display_name(name), *cells])
    if judged.known:
        known = [judged.known.get(problem) for problem in runs.settings.judge]
        rows.append(["best known", *(f"{value:.3g}" if value else "-" for value in known)])
    return markdown_table(["published -> tuned", *runs.settings.judge], rows)


def _signs(by_problem: ProblemDuels) -> dict[tuple[str, str], str]:
    """By problem and rival: ` +` if the subject is significantly better, ` -` if worse."""
    return {(problem, duel.rival): duel_sign(duel) for problem, found in by_problem for duel in found}


def _verdict(runs: JudgedRuns) -> Iterator[str]:
    settings = runs.settings
    ranks = runs.ranking(runs.labels(tuned=True)).ranks
    order = ", ".join(f"{display_name(label.removesuffix(TUNED))} {rank:.2f}" for label, rank in ranks.items())
    yield f"Average ranks over the {len(settings.judge)} judging problems, all tuned: {order}."
    subject = f"{SUBJECT}{TUNED}"
    if subject not in ranks:
        return
    found = runs.subject_duels(tuned=True)
    won, lost, fought = count_wins(found, subject)
    yield (
        f"**Does the paper's ranking hold when everybody is tuned?** MuPSO has place {list(ranks).index(subject) + 1} "
        f"of {len(ranks)}; it is better in {won}, worse in {lost} of {fought} duels with another tuned algorithm. "
        f"{power_text(settings.judge_repetitions, len(ranks) - 1)}."
    )
    yield duels_by_rival(found)


def _sweep_section(runs: JudgedRuns) -> Iterator[str]:
    sweep, problems = runs.settings.sweep, list(runs.settings.judge)
    if sweep is None:
        return
    yield f"## {display_name(sweep.algorithm)} against its `{sweep.parameter}`"
    yield _SWEEP_READING
    yield markdown_table([sweep.parameter, *problems], _sweep_rows(runs, sweep.algorithm))


def _sweep_rows(runs: JudgedRuns, algorithm: str) -> Iterator[list[str]]:
    table, problems = runs.medians(), list(runs.settings.judge)
    found = [dict(runs.sweep_duels(tuned=tuned)) for tuned in (False, True)]
    for value, label in runs.sweep_labels.items():
        medians = map(_median_text, table.loc[label])
        counts = [", ".join(_wins_text(duels.get(problem, []), label) for duels in found) for problem in problems]
        yield [f"{value:g}", *(f"{median} ({count})" for median, count in zip(medians, counts, strict=True))]
    for text, tuned in (("best other, published", False), ("best other, tuned", True)):
        others = runs.labels(tuned=tuned, without=algorithm)
        if others:
            yield [text, *map(_median_text, table.loc[others].min())]


def _wins_text(found: list[Duel], label: str) -> str:
    won, lost, _ = count_wins([("", found)], label)
    return f"+{won} -{lost}"


def _median_text(value: float) -> str:
    return f"{value:.3g}" if np.isfinite(value) else "-"
