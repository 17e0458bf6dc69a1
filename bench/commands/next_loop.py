"""The command of the closed loop: puts the truth machine, the diagnosis and the design together."""

from pathlib import Path

import click

_FOLDER = click.Path(path_type=Path)


@click.command("next-loop")
@click.option("--cases", type=click.IntRange(min=1), default=60, show_default=True, help="Ambiguous ones.")
@click.option("--seed", type=int, required=True, help="1000-1999 are for development.")
@click.option("--out", type=_FOLDER, required=True, help="Folder for recordings, answers and verdicts; goes on there.")
@click.option("--results", type=_FOLDER, help="Folder for table and picture [default: OUT/score].")
@click.option("--jobs", type=int, default=-1, show_default=True, help="Processes.")
@click.option("--duration", type=click.FloatRange(min=2), default=3.0, show_default=True, help="Of second motions, s.")
@click.option("--evaluations", type=click.IntRange(min=50), default=300, show_default=True, help="For each design.")
def next_loop(
    cases: int, seed: int, out: Path, results: Path | None, jobs: int, duration: float, evaluations: int
) -> None:
    """Ambiguous recording, diagnosis, second motion, both diagnosed: how often is the right name left? (`engines`)"""
    from functools import partial

    from tqdm import tqdm

    from bench.commands.loop_tools import move
    from concealed.loop import table
    from concealed.loop.case import Tools
    from concealed.loop.run import LoopSettings, play_all, seal
    from concealed.loop.run import results as finished
    from diagnosis.next.second import diagnosed, suspected

    settings = LoopSettings(cases, seed)
    tools = Tools(diagnosed, suspected, partial(move, duration, evaluations))
    for _ in tqdm(play_all(settings, out, tools, jobs), total=cases, unit="case", desc="closed loop"):
        pass
    found = finished(settings, out)
    for path in table.write(settings, found, seal(settings, out), results or out / "score"):
        click.echo(f"wrote {path}")
