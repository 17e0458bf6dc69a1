"""The command that measures speed."""

from pathlib import Path

import click


@click.command()
@click.option("--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True)
def speed(results: Path) -> None:
    """How fast, beside Pinocchio, mealpy, pygmo and scipy: speed.json and speed.md (extras `engines`, `peers`)."""
    from bench.speed.report import write_report

    for path in write_report(results):
        click.echo(path)
