"""The command that measures large sweeps."""

from pathlib import Path

import click

_PATH = click.Path(path_type=Path)


@click.command()
@click.option("--trials", type=click.IntRange(min=1), default=100_000, show_default=True)
@click.option("--kills", type=click.IntRange(min=1), help="Instead: kill the command, and its workers, so many times.")
@click.option("--results", type=_PATH, default=Path("results"), show_default=True)
@click.pass_context
def scale(context: click.Context, trials: int, kills: int | None, results: Path) -> None:
    """Memory, overhead and efficiency of large sweeps: scale.md. With --kills: kills.md, exit code 1 after a loss."""
    from bench.scale.command import write_kills, write_scale

    configs, unharmed = Path("configs"), True
    if kills:
        page, unharmed = write_kills(configs, kills, results, _tell)
    else:
        page = write_scale(configs, trials, results, _tell)
    click.echo(page)
    context.exit(0 if unharmed else 1)


def _tell(text: str) -> None:
    click.echo(text, err=True)
