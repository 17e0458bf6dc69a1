"""Commands about the best trajectories known: search on, hand one to a robot, ask whether it helps."""

from pathlib import Path

import click

RESULTS = click.option("--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True)


@click.command("best-known")
@click.option("--minutes", type=click.FloatRange(min=0), default=10.0, show_default=True)
@click.option("--problem", help="One of configs/best_known.yaml [default: all in turn].")
@RESULTS
def best_known(minutes: float, problem: str | None, results: Path) -> None:
    """Search on for better trajectories: best_known.json; stop it at any time, it goes on from there."""
    from bench.best_known.command import improve_best_known

    for line in improve_best_known(results, minutes, problem):
        click.echo(line)


@click.command("does-it-help")
@click.option("--workers", type=click.IntRange(min=1), help="Processes [default: one a core].")
@RESULTS
def does_it_help(workers: int | None, results: Path) -> None:
    """Does a small condition number help to identify the arm? Writes paper/does_it_help.*."""
    from joblib import cpu_count

    from bench.does_it_help.command import does_it_help as answer

    for path in answer(results, workers or cpu_count()):
        click.echo(path)


@click.command()
@click.argument("problem", type=click.Path(path_type=Path))
@click.option("--record", required=True, help="Name of a record in best_known.json.")
@click.option("--format", "form", type=click.Choice(["csv", "ros2", "rapid"]), default="csv", show_default=True)
@click.option("--rate", "rate_hz", type=click.FloatRange(min=1), default=250.0, show_default=True, help="Hz.")
@click.option("--out", type=click.Path(path_type=Path), required=True)
@RESULTS
def export(problem: Path, record: str, form: str, rate_hz: float, out: Path, results: Path) -> None:
    """Write the best trajectory known for a robot, if it keeps the limits of PROBLEM at the controller's rate."""
    from bench.best_known.record import FILE
    from bench.export.command import export as write

    write(problem, record, form, out, results / FILE, rate_hz)
    click.echo(out)
