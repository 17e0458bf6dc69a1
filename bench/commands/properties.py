"""The command that measures what algorithms do to their problems."""

from pathlib import Path

import click


@click.command()
@click.argument("algorithms", nargs=-1)
@click.option("--results", type=click.Path(path_type=Path), default=Path("results"), show_default=True)
def properties(algorithms: tuple[str, ...], results: Path) -> None:
    """Translation, scale, noise, bounds and overhead of ALGORITHMS [default: all]: properties.md and .csv."""
    from bench.properties.command import write_properties

    for path in write_properties(algorithms, results):
        click.echo(path)
