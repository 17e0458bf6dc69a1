"""Commands `armlab paper ...`: its tables and figures, and the studies that go on from them."""

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import click

from armlab.cli.experiments import read_run_options, run_configs, run_options
from armlab.cli.options import OutputPath
from armlab.cli.output import prints_lines, prints_result, trial_bar
from armlab.common.documents import ResultLines, written_files


@click.command()
@run_options
@prints_result
def table3(**options: Any) -> ResultLines:
    """Make Table 3 of the paper: configs/table3.yaml."""
    return run_configs([Path("configs/table3.yaml")], **options)


@click.command()
@run_options
@prints_result
def figure2(**options: Any) -> ResultLines:
    """Make Figure 2 of the paper: configs/figure2*.yaml.

    Once as published, and once at equal evaluations.
    """
    return run_configs([Path("configs/figure2.yaml"), Path("configs/figure2_equal_evaluations.yaml")], **options)


@click.command()
@run_options
@prints_result
def figure3(**options: Any) -> ResultLines:
    """Make Figure 3 of the paper: configs/figure3.yaml."""
    return run_configs([Path("configs/figure3.yaml")], **options)


@click.command()
@partial(run_options, results="results/paper")
@prints_lines
def replication(**options: Any) -> Iterator[str]:
    """Make all tables and figures of the paper.

    Writes them into results/paper/, with a report on which claims of the paper could be reproduced.
    """
    from bench.studies.paper.replication import describe_paper, make_paper

    return _make_study(make_paper, describe_paper, **options)


@click.command()
@partial(run_options, results="results/study")
@prints_lines
def study(**options: Any) -> Iterator[str]:
    """Compare the algorithms beyond the paper's cases.

    Six joints, randomly shifted coordinates, equal evaluations, larger budgets, and MuPSO's ingredients one by one.
    Writes into results/study/.
    """
    from bench.studies.beyond_paper.beyond_paper_study import describe_study, make_study

    return _make_study(make_study, describe_study, **options)


@click.command()
@partial(run_options, results="results/search_space")
@prints_lines
def search_space(**options: Any) -> Iterator[str]:
    """Compare the feasible search space with the coefficients.

    Every algorithm in both, and what the feasible one gives up of the best known: configs/search_space.yaml.
    """
    from bench.studies.search_space.search_space_study import describe_search_space, make_search_space

    return _make_study(make_search_space, describe_search_space, **options)


@click.command()
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core].")
@click.option("--results", type=OutputPath(), default=Path("results"), show_default=True)
@prints_result
def does_it_help(workers: int | None, results: Path) -> ResultLines:
    """Test whether a small condition number helps.

    Identifies a simulated arm with trajectories of many condition numbers. Writes paper/does_it_help.*.
    """
    from joblib import cpu_count

    from bench.studies.does_it_help.help_study import make_does_it_help as answer

    return written_files(answer(results, workers or cpu_count()))


def _make_study(make: Callable[..., Any], describe: Callable[..., Any], dry_run: bool, **options: Any) -> Iterator[str]:
    configs, settings = Path("configs"), read_run_options(**options)
    records = Path("results/best_known.json")
    yield from map(str, describe(configs, settings) if dry_run else make(configs, settings, records, trial_bar))
