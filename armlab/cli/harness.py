"""Commands of the benchmark harness: run experiments, list what there is, report, share, best known."""

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import Any

import click

from armlab.cli.options import FiniteNumber, OutputPath


def trial_bar(total: int, done: int) -> Any:
    """A bar over trials with the time left; silent where no one watches."""
    from tqdm import tqdm

    return tqdm(total=total, initial=done, unit="trial", disable=None)  # None: only on a terminal


_DEFAULT_STORE = Path(".armlab/runs.sqlite")


def _run_options(command: Callable[..., None], results: str = "results") -> Callable[..., None]:
    options = (
        click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core]."),
        click.option(
            "--store",
            type=click.Path(path_type=Path),
            default=_DEFAULT_STORE,
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
@_run_options
def run(config: Path, **options: Any) -> None:
    """Run the missing trials of CONFIG and write its results."""
    _run_configs([config], **options)


@click.command()
@_run_options
def table3(**options: Any) -> None:
    """Make Table 3 of the paper: configs/table3.yaml."""
    _run_configs([Path("configs/table3.yaml")], **options)


@click.command()
@_run_options
def figure2(**options: Any) -> None:
    """Make Figure 2 of the paper: configs/figure2*.yaml.

    Once as published, and once at equal evaluations.
    """
    _run_configs([Path("configs/figure2.yaml"), Path("configs/figure2_equal_evaluations.yaml")], **options)


@click.command()
@_run_options
def figure3(**options: Any) -> None:
    """Make Figure 3 of the paper: configs/figure3.yaml."""
    _run_configs([Path("configs/figure3.yaml")], **options)


@click.command()
@partial(_run_options, results="results/paper")
def paper(**options: Any) -> None:
    """Make all tables and figures of the paper.

    Writes them into results/paper/, with a report on which claims of the paper could be reproduced.
    """
    from bench.studies.paper.replication import describe_paper, make_paper

    _make_study(make_paper, describe_paper, **options)


@click.command()
@partial(_run_options, results="results/study")
def study(**options: Any) -> None:
    """Compare the algorithms beyond the paper's cases.

    Six joints, randomly shifted coordinates, equal evaluations, larger budgets, and MuPSO's ingredients one by one.
    Writes into results/study/.
    """
    from bench.studies.beyond_paper.study import describe_study, make_study

    _make_study(make_study, describe_study, **options)


def _make_study(make: Callable[..., Any], describe: Callable[..., Any], dry_run: bool, **options: Any) -> None:
    configs, settings = Path("configs"), _read_run_options(**options)
    records = Path("results/best_known.json")
    for line in describe(configs, settings) if dry_run else make(configs, settings, records, trial_bar):
        click.echo(line)


def _run_configs(configs: Sequence[Path], dry_run: bool, **options: Any) -> None:
    from bench.run import describe_run, run_experiment

    settings = _read_run_options(**options)
    for config in configs:
        for line in describe_run(config, settings) if dry_run else run_experiment(config, settings, trial_bar):
            click.echo(line)


def _read_run_options(workers: int | None, executor: str | None, address: str | None, **options: Any) -> Any:
    from joblib import cpu_count

    from armlab.common.settings import validate
    from bench.executors.contract import ExecutorSettings
    from bench.run import RunOptions

    if address and not executor:
        raise click.UsageError("--address should stand beside --executor dask or --executor ray")
    chosen = validate(ExecutorSettings, {"backend": executor, "address": address}, "--executor") if executor else None
    return RunOptions(workers=workers or cpu_count(), executor=chosen, **options)


@click.command("list")
def list_names() -> None:
    """List the algorithms, problems and arms by their names.

    A configuration uses these names.
    """
    from algorithms import registry as algorithms
    from problem import registry as problems
    from problem.robot_file import built_in_arms
    from problem.suite import instances, suites

    click.echo("algorithms: " + ", ".join(algorithms.names()))
    click.echo("peers (extra `peers`): " + ", ".join(algorithms.peer_names()))
    click.echo("with derivatives: " + ", ".join(algorithms.names_with_derivatives()))
    click.echo("problems: " + ", ".join(problems.names()))
    for suite in suites():
        click.echo(f"suite {suite}: {len(instances(suite))} problems, {instances(suite)[0]} the first")
    click.echo("arms: " + ", ".join(built_in_arms()))


@click.command()
@click.argument("robot")
@click.option("--columns", type=click.Choice(["later_columns", "earlier_columns"]), default="later_columns")
def base(robot: str, columns: str) -> None:
    """Show the base parameters of ROBOT.

    ROBOT: the name of a built-in arm, a robot file or a URDF.
    """
    from problem.base_parameters import base_parameters
    from problem.robot_file import load_arm

    found = base_parameters(load_arm(robot), columns)
    click.echo(f"{len(found)} base parameters:\n  " + "\n  ".join(found.sums))
    click.echo(f"{len(found.alone)} identifiable alone: " + " ".join(found.alone))
    click.echo(f"{len(found.grouped)} only in sums: " + " ".join(found.grouped))
    click.echo(f"{len(found.unidentifiable)} without effect: " + " ".join(found.unidentifiable))


@click.command()
@click.argument("algorithm")
def check(algorithm: str) -> None:
    """Test whether ALGORITHM keeps its contract."""
    from algorithms.check import BrokenPromiseError, check_algorithm
    from bench.config import find_algorithm

    try:
        check_algorithm(find_algorithm(algorithm, "check"))
    except BrokenPromiseError as error:
        raise click.ClickException(str(error)) from None
    click.echo(f"{algorithm} keeps its promises")


_PATH = click.Path(path_type=Path)
_STORE_OPTION = click.option(
    "--store", type=_PATH, default=_DEFAULT_STORE, show_default=True, help="File of the run store."
)


@click.command()
@click.argument("results", type=_PATH)
@_STORE_OPTION
@click.option("--out", type=OutputPath(), help="HTML file [default: results/NAME_report.html].")
def report(results: Path, store: Path, out: Path | None) -> None:
    """Write one HTML page about RESULTS.

    RESULTS: a configuration file whose trials were run, or a folder that `share` wrote. The page needs no other
    file.
    """
    from bench.report.page import write_report

    click.echo(write_report(results, store, out))


@click.command()
@click.argument("first", type=_PATH)
@click.argument("second", type=_PATH)
@_STORE_OPTION
@click.option("--out", type=OutputPath(), help="Folder for comparison.md and .csv [default: print only].")
def compare(first: Path, second: Path, store: Path, out: Path | None) -> None:
    """Show what changed between two sets of results.

    Compares SECOND with FIRST, algorithm by algorithm and problem by problem. Each is a configuration file whose
    trials were run, or a folder that `share` wrote.
    """
    from bench.result_sets.compare import compare_results

    click.echo(compare_results(first, second, store, out), nl=False)


@click.command()
@click.argument("results", type=_PATH)
@_STORE_OPTION
@click.option("--as", "form", type=click.Choice(["csv", "parquet", "ioh"]), default="csv", show_default=True)
@click.option("--out", type=OutputPath(), required=True, help="Folder to write into.")
def share(results: Path, store: Path, form: str, out: Path) -> None:
    """Write RESULTS as tables or in IOHprofiler's format.

    csv, parquet: tidy tables. ioh: the format of IOHprofiler. RESULTS: a configuration file whose trials were run,
    or a folder that `share` wrote.
    """
    from bench.result_sets.formats import share_results

    for path in share_results(results, store, form, out):
        click.echo(path)


@click.command()
@click.argument("results", type=_PATH)
@_STORE_OPTION
@click.option("--out", type=_PATH, required=True, help="Folder to write into.")
@click.option(
    "--records",
    type=_PATH,
    default=Path("results/best_known.json"),
    show_default=True,
    help="File of the best known trajectories.",
)
def draw(results: Path, store: Path, out: Path, records: Path) -> None:
    """Draw RESULTS: ends, ranking, budgets.

    Writes PNG and SVG: every end with median and best known, the ranks over problems, and the medians against the
    budget, as they fit. RESULTS: a configuration file whose trials were run, or a folder that `share` wrote.
    """
    from bench.result_sets.draw import draw_results

    for path in draw_results(results, store, records, out):
        click.echo(path)


@click.command()
@click.argument("damaged", type=_PATH)
@click.option("--out", type=OutputPath(), required=True, help="File of the new store.")
def salvage(damaged: Path, out: Path) -> None:
    """Copy what is readable of a DAMAGED run store.

    The copy is a new store; the next run computes what it lacks.
    """
    from bench.store import salvage as save

    click.echo(f"{save(damaged, out)} outcomes of {damaged} are in {out}")


@click.command()
@click.argument("algorithms", nargs=-1)
@click.option("--results", type=OutputPath(), default=Path("results"), show_default=True)
def properties(algorithms: tuple[str, ...], results: Path) -> None:
    """Measure general properties of ALGORITHMS [default: all].

    Behaviour under translation, scale and noise, use of the bounds, and overhead. Writes properties.md and
    properties.csv.
    """
    from bench.studies.properties import write_properties

    for path in write_properties(algorithms, results):
        click.echo(path)


_RESULTS_OPTION = click.option("--results", type=OutputPath(), default=Path("results"), show_default=True)


@click.command("best-known")
@click.option("--minutes", type=FiniteNumber(min=0), default=10.0, show_default=True)
@click.option("--problem", help="Name of a problem in configs/best_known.yaml [default: all in turn].")
@_RESULTS_OPTION
def best_known(minutes: float, problem: str | None, results: Path) -> None:
    """Search for better trajectories than the best known.

    Updates best_known.json. You can stop the search at any time; the next call continues from there.
    """
    from bench.studies.best_known.search import improve_best_known

    for line in improve_best_known(results, minutes, problem):
        click.echo(line)


@click.command()
@click.argument("algorithms", nargs=-1)
@click.option("--config", type=_PATH, default=Path("configs/tune.yaml"), show_default=True)
@click.option("--budget", type=click.IntRange(min=2), help="Configurations an algorithm [default: the file's].")
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core].")
@_STORE_OPTION
@click.option("--results", type=click.Path(path_type=Path), default=Path("results/tune"), show_default=True)
def tune(
    algorithms: tuple[str, ...], config: Path, budget: int | None, workers: int | None, store: Path, results: Path
) -> None:
    """Tune ALGORITHMS, the same budget for each [default: all].

    Tries hyper-parameters on training problems and judges the best ones on problems that took no part, beside the
    published ones. You can stop it at any time; the next call continues from there. Needs the extra `tune`.
    """
    from joblib import cpu_count

    from bench.studies.tuning.study import TuningOptions, tune_algorithms

    records = Path("results/best_known.json")
    options = TuningOptions(algorithms, budget, store, results, records, workers or cpu_count())
    for path in tune_algorithms(config, options, trial_bar):
        click.echo(path)


@click.command("does-it-help")
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core].")
@_RESULTS_OPTION
def does_it_help(workers: int | None, results: Path) -> None:
    """Test whether a small condition number helps.

    Identifies a simulated arm with trajectories of many condition numbers. Writes paper/does_it_help.*.
    """
    from joblib import cpu_count

    from bench.studies.does_it_help.study import make_does_it_help as answer

    for path in answer(results, workers or cpu_count()):
        click.echo(path)


@click.command()
@click.argument("problem", type=click.Path(path_type=Path))
@click.option("--record", required=True, help="Name of a record in best_known.json.")
@click.option("--format", "form", type=click.Choice(["csv", "ros2", "rapid"]), default="csv", show_default=True)
@click.option(
    "--rate",
    "rate_hz",
    type=FiniteNumber(min=1, max=100_000),
    default=250.0,
    show_default=True,
    help="Sampling rate, Hz.",
)
@click.option("--out", type=OutputPath(), required=True)
@_RESULTS_OPTION
def export(problem: Path, record: str, form: str, rate_hz: float, out: Path, results: Path) -> None:
    """Write a best known trajectory for a robot controller.

    Refuses a trajectory that breaks a limit of PROBLEM at the controller's rate.
    """
    from bench.studies.best_known.export import export_record as write
    from bench.studies.best_known.records import RECORDS_FILE

    write(problem, record, form, out, results / RECORDS_FILE, rate_hz)
    click.echo(out)
