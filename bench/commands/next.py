"""The command that designs the next experiment: the diagnosis designs it, the exports of trajectories write it."""

from pathlib import Path

import click

_FILE = click.Path(path_type=Path)


@click.command("next")
@click.argument("verdict", type=_FILE)
@click.option("--robot", required=True, help="A built-in arm, a robot file or a URDF, with the limits of the joints.")
@click.option("--recording", type=_FILE, help="The recording that was diagnosed: counts what it shows already.")
@click.option(
    "--rivals", help="Like viscous_friction@2,time_delay; or library: all that come near [default: of VERDICT]"
)
@click.option("--algorithm", default="l-shade", show_default=True, help="Any registered one.")
@click.option("--evaluations", type=click.IntRange(min=50), default=1000, show_default=True)
@click.option("--duration", type=click.FloatRange(min=1), default=10.0, show_default=True, help="Of the motion, s.")
@click.option("--harmonics", type=click.IntRange(min=2), default=8, show_default=True)
@click.option(
    "--links",
    type=click.Choice(["exact", "near", "free"]),
    help="How well links are known [default: exact where the diagnosis left them, else near; free without].",
)
@click.option("--rate", "rate_hz", type=click.FloatRange(min=1), default=250.0, show_default=True, help="Hz.")
@click.option("--out", type=_FILE, default=Path("next"), show_default=True)
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
def next_experiment(
    verdict: Path,
    robot: str,
    recording: Path | None,
    rivals: str | None,
    algorithm: str,
    evaluations: int,
    duration: float,
    harmonics: int,
    links: str | None,
    rate_hz: float,
    out: Path,
    seed: int,
) -> None:
    """Design the motion that decides between the rivals of VERDICT: CSV, ROS 2, RAPID, card and picture."""
    from bench.commands.next_files import next_lines
    from diagnosis.next.design import Budget

    budget = Budget(duration, harmonics, algorithm, evaluations, seed)
    for line in next_lines(verdict, robot, recording, rivals, budget, links, rate_hz, out):
        click.echo(line)
