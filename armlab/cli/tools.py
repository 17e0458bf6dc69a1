"""Commands `armlab doctor` and `armlab tools ...`: the installation, and what maintainers measure."""

from pathlib import Path

import click

from armlab.cli.options import OutputPath
from armlab.cli.output import prints_result, trial_bar
from armlab.common.documents import ResultLines, written_files


@click.command()
@prints_result
def doctor() -> ResultLines:
    """Examine the installation and test it shortly.

    Versions, extras, compiled kernels, folders, and a self-test of a few seconds. Exit code 1 if something that is
    needed is broken.
    """
    from armlab.cli.doctor import examine_installation

    return examine_installation()


@click.command()
@click.option("--out", type=OutputPath(), help="File for the page [default: the terminal].")
@prints_result
def tuning(out: Path | None) -> ResultLines:
    """List the tuning numbers of the diagnosis.

    Each with its value, unit, meaning and source, as Markdown. Their names are those of `diagnose --set` and
    `proof ablate --vary`. Then how many there are, and how many constants beside them.
    """
    from armlab.common.files import write_texts
    from armlab.diagnosis.tuning import Tuning, tuning_numbers, tuning_page
    from armlab.diagnosis.tuning_counts import count_tuning

    if out is None:
        yield tuning_page().rstrip("\n")
    else:
        write_texts({out.name: tuning_page()}, out.parent)
        yield f"wrote {out}"
    counts = count_tuning()
    yield f"tuning numbers {counts.numbers}, of which {counts.by_eye} are chosen by eye"
    yield f"read where names are tested and weighed {counts.deciding}"
    yield f"named constants of modules of the diagnosis and the reading {counts.constants}"
    return {"tuning": list(tuning_numbers(Tuning())), "counts": counts, "files": [] if out is None else [out]}


@click.command()
@click.option(
    "--update-baseline", "task", flag_value="update_baseline", help="Make the results of the present code the baseline."
)
@click.option("--extend-baseline", "task", flag_value="extend_baseline", help="Add the cells that the baseline lacks.")
@click.option("--calibrate", "task", flag_value="calibrate", help="Compute false-alarm rate and power (minutes).")
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core].")
@click.option("--config", type=click.Path(path_type=Path), default=Path("configs/regression.yaml"), show_default=True)
@click.option("--results", type=OutputPath(), default=Path("results/regression"), show_default=True)
@click.pass_context
def regression(context: click.Context, task: str | None, workers: int | None, config: Path, results: Path) -> None:
    """Compare a short fixed sweep with the committed baseline.

    Exit code 1 if a condition number changed.
    """
    from joblib import cpu_count

    from bench.studies.regression.tasks import RegressionTasks

    report = getattr(RegressionTasks(config, results, workers or cpu_count(), trial_bar), task or "check")()
    for line in report.lines:
        click.echo(line)
    context.exit(report.exit_code)


@click.command()
@click.option("--results", type=OutputPath(), default=Path("results/speed"), show_default=True)
@prints_result
def speed(results: Path) -> ResultLines:
    """Measure speed beside that of other packages.

    The others are Pinocchio, CasADi, mealpy, pygmo and scipy (extra `peers`). Writes speed.json and speed.md. Needs a C
    compiler, and a C++ compiler for the code built by hand.
    """
    from bench.studies.speed.speed_page import write_speed_report

    return written_files(write_speed_report(results))


@click.command()
@click.option("--results", type=OutputPath(), default=Path("results"), show_default=True)
@prints_result
def intervals(results: Path) -> ResultLines:
    """Compute the intervals of A12 in written results anew.

    From A12 and the number of runs, which is all they need: after a change of the method no trial has to be run.
    Rewrites the tables, and the pages and figures beside them that show intervals.
    """
    from bench.studies.intervals import renew_intervals

    return written_files(renew_intervals(results))


@click.command()
@click.option("--trials", type=click.IntRange(min=1), default=100_000, show_default=True)
@click.option("--kills", type=click.IntRange(min=1), help="Kill the command and its workers that many times instead.")
@click.option("--workers", type=click.IntRange(min=1), help="Simulate that many Dask workers in one process instead.")
@click.option("--results", type=OutputPath(), default=Path("results/speed"), show_default=True)
@click.pass_context
def scale(context: click.Context, trials: int, kills: int | None, workers: int | None, results: Path) -> None:
    """Measure memory, overhead and efficiency of large sweeps.

    Writes scale.md. With --kills: kills processes at random times and writes kills.md; exit code 1 if an outcome
    was lost. With --workers: writes cluster.md.
    """
    from bench.studies.scale.scale_page import write_cluster, write_kills, write_scale

    configs, unharmed = Path("configs"), True
    if kills:
        page, unharmed = write_kills(configs, kills, results, _print_progress)
    elif workers:
        page = write_cluster(configs, workers, results, _print_progress)
    else:
        page = write_scale(configs, trials, results, _print_progress)
    click.echo(page)
    context.exit(0 if unharmed else 1)


def _print_progress(text: str) -> None:
    click.echo(text, err=True)
