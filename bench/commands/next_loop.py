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
def next_loop(cases: int, seed: int, out: Path, results: Path | None, jobs: int) -> None:
    """Ambiguous recording, diagnosis, second motion, both diagnosed: how often is the right name left? (`engines`)"""
    from tqdm import tqdm

    from bench.commands.loop_tools import move
    from concealed.loop import page
    from concealed.loop.case import Tools
    from concealed.loop.run import LoopSettings, closed, play_all, sealed
    from concealed.loop.run import results as finished
    from diagnosis.next.second import diagnosed, suspected

    settings = LoopSettings(cases, seed)
    answers = sealed(settings, out)
    click.echo(f"sealed {out / 'truth'}, SHA-256 of the answers {answers}")
    for _ in tqdm(play_all(settings, out, Tools(diagnosed, suspected, move), jobs), total=cases, unit="case"):
        pass
    found = finished(settings, out)
    manifest = closed(settings, out, answers)
    for path in page.write(settings, found, page.Seal(answers, manifest), results or out / "score"):
        click.echo(f"wrote {path}")
