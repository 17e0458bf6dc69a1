"""Commands that run experiments."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from bench.commands.progress import trial_bar

_STORE = Path(".armlab/runs.sqlite")


def _run_options(command: Callable[..., None], results: str = "results") -> Callable[..., None]:
    options = (
        click.option("--workers", type=click.IntRange(min=1), help="Processes [default: one a core]."),
        click.option(
            "--store",
            type=click.Path(path_type=Path),
            default=_STORE,
            show_default=True,
            help="File that keeps finished trials.",
        ),
        click.option(
            "--results",
            type=click.Path(path_type=Path),
            default=Path(results),
            show_default=True,
            help="Folder for tables and figures.",
        ),
        click.option(
            "--executor",
            type=click.Choice(["loky", "dask", "ray"]),
            help="Engine [default: that of the configuration, else loky: processes on this machine].",
        ),
        click.option("--address", help="Of a running Dask or Ray cluster [default: processes on this machine]."),
        click.option("--dry-run", is_flag=True, help="List the trials and estimate the time; run nothing."),
        click.option("--fresh", is_flag=True, help="Compute again what is already kept."),
        click.option("--overwrite", is_flag=True, help="Replace results of another configuration."),
    )
    for option in reversed(options):
        command = option(command)
    return command


@click.command()
@click.argument("config", type=click.Path(path_type=Path))
@_run_options
def run(config: Path, **options: Any) -> None:
    """Run what is missing of an experiment and write its results."""
    _run([config], **options)


@click.command()
@_run_options
def table3(**options: Any) -> None:
    """Table 3 of the paper: configs/table3.yaml."""
    _run([Path("configs/table3.yaml")], **options)


@click.command()
@_run_options
def figure2(**options: Any) -> None:
    """Figure 2, as published and at equal evaluations: configs/figure2*.yaml."""
    _run([Path("configs/figure2.yaml"), Path("configs/figure2_equal_evaluations.yaml")], **options)


@click.command()
@_run_options
def figure3(**options: Any) -> None:
    """Figure 3 of the paper: configs/figure3.yaml."""
    _run([Path("configs/figure3.yaml")], **options)


@click.command()
@partial(_run_options, results="results/paper")
def paper(**options: Any) -> None:
    """All tables and figures of the paper, and what of it could be reproduced: results/paper/."""
    from bench.paper.command import describe_paper, make_paper

    _make(make_paper, describe_paper, **options)


@click.command()
@partial(_run_options, results="results/study")
def study(**options: Any) -> None:
    """The comparison where the paper stops: six joints, frames, budgets, MuPSO's ingredients: results/study/."""
    from bench.study.command import describe_study, make_study

    _make(make_study, describe_study, **options)


def _make(make: Callable[..., Any], describe: Callable[..., Any], dry_run: bool, **options: Any) -> None:
    configs, settings = Path("configs"), _settings(**options)
    records = Path("results/best_known.json")
    for line in describe(configs, settings) if dry_run else make(configs, settings, records, trial_bar):
        click.echo(line)


def _run(configs: Sequence[Path], dry_run: bool, **options: Any) -> None:
    from bench.dry_run import describe
    from bench.experiment import run_experiment

    settings = _settings(**options)
    for config in configs:
        for line in describe(config, settings) if dry_run else run_experiment(config, settings, trial_bar):
            click.echo(line)


def _settings(workers: int | None, executor: str | None, address: str | None, **options: Any) -> Any:
    from joblib import cpu_count

    from bench.engines.contract import Executor
    from bench.experiment import Options
    from problem.settings import validate

    if address and not executor:
        raise click.UsageError("--address should stand beside --executor dask or --executor ray")
    chosen = validate(Executor, {"backend": executor, "address": address}, "--executor") if executor else None
    return Options(workers=workers or cpu_count(), executor=chosen, **options)
