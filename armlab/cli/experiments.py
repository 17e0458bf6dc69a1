"""Commands `armlab run`, `report` and `check`, and the options that run trials."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from armlab.cli.options import OutputPath, PagePath
from armlab.cli.output import prints_result, tell_progress, trial_bar
from armlab.common.documents import ResultLines

DEFAULT_STORE = Path(".armlab/runs.sqlite")
PATH = click.Path(path_type=Path)
store_option = click.option(
    "--store", type=PATH, default=DEFAULT_STORE, show_default=True, help="File of the run store."
)


def run_options(command: Callable[..., None], results: str = "results") -> Callable[..., None]:
    options = (
        click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core]."),
        click.option(
            "--store",
            type=click.Path(path_type=Path),
            default=DEFAULT_STORE,
            show_default=True,
            help="File of the run store, which keeps finished trials.",
        ),
        click.option(
            "--results",
            type=OutputPath(),
            default=Path(results),
            show_default=True,
            help="Folder for tables and figures.",
        ),
        click.option(
            "--executor",
            type=click.Choice(["loky", "dask", "ray"]),
            help="Where the trials run [default: as configured, else loky: processes on this machine].",
        ),
        click.option("--address", help="Address of a running Dask or Ray cluster [default: start processes here]."),
        click.option("--dry-run", is_flag=True, help="List the trials and estimate the time; run nothing."),
        click.option("--fresh", is_flag=True, help="Compute stored trials again."),
        click.option("--overwrite", is_flag=True, help="Replace results of another configuration."),
    )
    for option in reversed(options):
        command = option(command)
    return command


@click.command()
@click.argument("config", type=click.Path(path_type=Path))
@run_options
@prints_result
def run(config: Path, **options: Any) -> ResultLines:
    """Run the missing trials of CONFIG and write its results."""
    return run_configs([config], **options)


@click.command()
@click.argument("results", type=PATH)
@store_option
@click.option("--out", type=PagePath(), help="HTML file [default: results/NAME_report.html].")
@prints_result
def report(results: Path, store: Path, out: Path | None) -> ResultLines:
    """Write one HTML page about RESULTS.

    RESULTS: a configuration file whose trials were run, or a folder that `bench share` wrote. The page needs no other
    file.
    """
    from bench.report.page import write_report

    return write_report(results, store, out, tell_progress)


@click.command()
@click.argument("algorithm")
@prints_result
def check(algorithm: str) -> ResultLines:
    """Test whether ALGORITHM keeps its contract."""
    from algorithms.check import BrokenPromiseError, check_algorithm
    from bench.config import find_algorithm

    try:
        check_algorithm(find_algorithm(algorithm, "check"))
    except BrokenPromiseError as error:
        raise click.ClickException(str(error)) from None
    yield f"{algorithm} keeps its promises"
    return {"algorithm": algorithm, "keeps_its_promises": True}


def run_configs(configs: Sequence[Path], dry_run: bool, **options: Any) -> ResultLines:
    from bench.run import describe_run, report_run

    settings = read_run_options(**options)
    documents = []
    for config in configs:
        lines = describe_run(config, settings) if dry_run else report_run(config, settings, trial_bar)
        documents.append((yield from lines))
    return {"experiments": documents}


def read_run_options(workers: int | None, executor: str | None, address: str | None, **options: Any) -> Any:
    from joblib import cpu_count

    from armlab.common.settings import validate
    from bench.executors.contract import ExecutorSettings
    from bench.run import RunOptions

    if address and not executor:
        raise click.UsageError("--address should stand beside --executor dask or --executor ray")
    chosen = validate(ExecutorSettings, {"backend": executor, "address": address}, "--executor") if executor else None
    return RunOptions(workers=workers or cpu_count(), executor=chosen, **options)
