"""What tuning changed: tables of the configurations and of the judged runs, and the page that says who wins then."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd

from armlab.common.markdown import markdown_page, markdown_table
from bench.printed import display_name
from bench.statistics.critical_difference import CriticalDifference, block_losses, critical_difference
from bench.statistics.pairwise import Duel, duels, log_losses
from bench.statistics.power import power_text
from bench.studies.tuning.search import Tuned, median_ends, params_text
from bench.studies.tuning.settings import TuningSettings

TUNED = " tuned"
"""Ends the label of an algorithm with its tuned hyper-parameters."""
SUBJECT = "mupso"


def sweep_label(algorithm: str, parameter: str, value: float) -> str:
    """The label of one value of the sweep."""
    return f"{algorithm} {parameter}={value:g}"


@dataclass(frozen=True, eq=False)
class Judgement:
    """frame: tidy outcomes on the judging problems, of each algorithm as published, as tuned, and of the sweep.

    known: best condition numbers by problem.
    """

    settings: TuningSettings
    tuned: tuple[Tuned, ...]
    frame: pd.DataFrame
    known: Mapping[str, float]

    def contest(self, *, as_published: bool = True) -> pd.DataFrame:
        """The rows without the sweep; only the tuned ones if not `as_published`."""
        labels = [f"{one.algorithm}{TUNED}" for one in self.tuned]
        labels += [one.algorithm for one in self.tuned] if as_published else []
        return self.frame[self.frame["algorithm"].isin(labels)].reset_index(drop=True)

    def ranking(self, *, as_published: bool) -> CriticalDifference:
        """Average ranks over the judging problems, of the tuned algorithms alone or beside the published ones."""
        problems = self.contest(as_published=as_published).groupby("problem", sort=False)
        return critical_difference(block_losses([log_losses(rows) for _, rows in problems]))

    def table(self) -> pd.DataFrame:
        """One row a label of the judged runs, one column a problem: the median of its ends."""
        rows = [
            {"algorithm": str(label), **median_ends(group)}
            for label, group in self.frame.groupby("algorithm", sort=False)
        ]
        return pd.DataFrame(rows)[["algorithm", *self.settings.judge]]

    def tuning_duels(self) -> list[tuple[str, list[Duel]]]:
        """By problem: each tuned algorithm against itself as published, Holm over the algorithms."""
        pairs = [(f"{one.algorithm}{TUNED}", one.algorithm) for one in self.tuned]
        return [(str(name), duels(rows, pairs)) for name, rows in self.contest().groupby("problem", sort=False)]

    def subject_duels(self) -> list[tuple[str, list[Duel]]]:
        """By problem: tuned MuPSO against every other tuned algorithm, Holm over them."""
        rivals = [one.algorithm for one in self.tuned if one.algorithm != SUBJECT]
        pairs = [(f"{SUBJECT}{TUNED}", f"{rival}{TUNED}") for rival in rivals]
        return [(str(name), duels(rows, pairs)) for name, rows in self.contest().groupby("problem", sort=False)]


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
All other hyper-parameters as published. The last line but one is the least median of the other algorithms as published,
the last one as tuned: where MuPSO's number is below, it would win there."""


def tuning_page(judged: Judgement) -> str:
    """The tables and their verdict as a Markdown page."""
    settings = judged.settings
    effort = (
        f"{settings.configurations} configurations an algorithm x {len(settings.train)} problems x "
        f"{settings.train_repetitions} repetitions of {settings.evaluations} evaluations; judged on "
        f"{len(settings.judge)} problems with {settings.judge_repetitions} repetitions. All settings: "
        f"`{settings.name}.settings.yaml`."
    )
    sections = [
        "## What tuning found",
        markdown_table(_FOUND_HEADINGS, _found_rows(judged)),
        "## Medians on the problems that took no part",
        _medians_table(judged),
        *_verdict(judged),
        f"![Ranks on the judging problems]({settings.name}_ranking.png)",
        *_sweep_section(judged),
    ]
    return markdown_page(settings.name, _READING, effort, *sections)


def _found_rows(judged: Judgement) -> Iterator[list[str]]:
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


def _medians_table(judged: Judgement) -> str:
    table = judged.table().set_index("algorithm")
    rows = []
    for one in judged.tuned:
        before, after = table.loc[one.algorithm], table.loc[f"{one.algorithm}{TUNED}"]
        cells = [f"{before[name]:.3g} -> {after[name]:.3g}{_sign(judged, name, one)}" for name in judged.settings.judge]
        rows.append([display_name(one.algorithm), *cells])
    if judged.known:
        best = [f"{judged.known[name]:.3g}" if name in judged.known else "-" for name in judged.settings.judge]
        rows.append(["best known", *best])
    return markdown_table(["published -> tuned", *judged.settings.judge], rows)


def _sign(judged: Judgement, problem: str, one: Tuned) -> str:
    """`+` if tuning helped at 5 %, `-` if it harmed."""
    found = dict(judged.tuning_duels())[problem]
    duel = next(duel for duel in found if duel.rival == one.algorithm)
    return {duel.subject: " +", duel.rival: " -"}.get(str(duel.winner()), "")


def _verdict(judged: Judgement) -> Iterator[str]:
    ranks = judged.ranking(as_published=False).ranks
    order = ", ".join(f"{_tuned_name(label)} {rank:.2f}" for label, rank in ranks.items())
    problems = len(judged.settings.judge)
    yield f"Average ranks over the {problems} judging problems, all tuned: {order}."
    subject = f"{SUBJECT}{TUNED}"
    if subject not in ranks:
        return
    place = list(ranks).index(subject) + 1
    fought = [duel for _, found in judged.subject_duels() for duel in found]
    won = sum(duel.winner() == duel.subject for duel in fought)
    lost = sum(duel.winner() == duel.rival for duel in fought)
    yield (
        f"**Does the paper's ranking hold when everybody is tuned?** MuPSO has place {place} of {len(ranks)}; it is "
        f"better in {won}, worse in {lost} of {len(fought)} duels with another tuned algorithm. "
        f"{power_text(judged.settings.judge_repetitions, len(ranks) - 1)}."
    )


def _tuned_name(label: str) -> str:
    return display_name(label.removesuffix(TUNED))


def _sweep_section(judged: Judgement) -> Iterator[str]:
    sweep, problems = judged.settings.sweep, judged.settings.judge
    if sweep is None:
        return
    table = judged.table().set_index("algorithm")
    labels = {f"{value:g}": [sweep_label(sweep.algorithm, sweep.parameter, value)] for value in sweep.values}
    others = [one.algorithm for one in judged.tuned if one.algorithm != sweep.algorithm]
    if others:
        labels |= {"best other, published": others, "best other, tuned": [f"{name}{TUNED}" for name in others]}
    rows = [[text, *_format_medians(table.loc[chosen, list(problems)].min())] for text, chosen in labels.items()]
    yield f"## {display_name(sweep.algorithm)} against its `{sweep.parameter}`"
    yield _SWEEP_READING
    yield markdown_table([sweep.parameter, *problems], rows)


def _format_medians(medians: "pd.Series[float]") -> list[str]:
    return [f"{value:.3g}" if np.isfinite(value) else "-" for value in medians]
