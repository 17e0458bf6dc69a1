"""The command that measures how alike simulated and real recordings are."""

from collections.abc import Iterator
from pathlib import Path

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines

_PATH = click.Path(path_type=Path)


@click.command()
@click.option("--seed", type=click.IntRange(1000, 1999), required=True, help="A development seed.")
@click.option("--cases", type=click.IntRange(min=10), default=60, show_default=True, help="Field nulls.")
@click.option("--realistic", type=click.IntRange(min=10), default=40, show_default=True, help="Realistic nulls beside.")
@click.option("--pictures", type=click.IntRange(min=0), default=0, help="Pictures of each side for a reader to sort.")
@click.option("--work", type=_PATH, help="Folder for recordings [default: .armlab/likeness/SEED].")
@click.option("--results", type=OutputPath(), default=Path("results/field"), show_default=True)
@click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes.")
@prints_lines
def likeness(
    seed: int, cases: int, realistic: int, pictures: int, work: Path | None, results: Path, jobs: int
) -> Iterator[str]:
    """Measure how alike simulated and real recordings are.

    Makes nulls of the realistic and of the field tier, trains a classifier on features of them and of the real
    recordings below ARMLAB_RECORDINGS, one real arm left out at a time, and writes the area under its curve with both
    distributions. Each look is logged (extra `dev`).
    """
    from armlab.common.errors import InputError
    from armlab.common.files import write_texts
    from armlab.proof.blind.sealed import code_commit
    from armlab.proof.open.likeness.page import likeness_texts
    from armlab.proof.open.likeness.pictures import Pictured, draw_pictures
    from armlab.proof.open.likeness.real_arms import drawable_folders, real_folders
    from armlab.proof.open.likeness.study import (
        LOOKS_FILE,
        compare,
        look_of,
        looks_text,
        read_looks,
        read_real_arms,
        read_simulated_arms,
    )
    from armlab.proof.tiers.likeness_sets import make_field_nulls, make_realistic_nulls
    from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_copies

    local = local_copies()
    if local is None:
        raise InputError(f"set {LOCAL_COPIES_VARIABLE} to a folder with recordings of real arms")
    commit, folder = code_commit(), work or Path(f".armlab/likeness/{seed}")
    made = {
        "realistic": make_realistic_nulls(seed, realistic, folder / "realistic", jobs),
        "field": make_field_nulls(seed, cases, folder / "field", jobs),
    }
    folders = list(real_folders(local, folder / "public"))
    real, looks, sides = list(read_real_arms(folders)), read_looks(results), {}
    for tier, simulated in made.items():
        sides[tier] = compare([*real, *read_simulated_arms(simulated)])
        look = look_of(sides[tier], commit, tier, seed)
        looks += [] if look in looks else [look]
        yield f"{tier}: area {look.area:.3f} ({look.low:.3f} to {look.high:.3f}), most used {', '.join(look.strongest)}"
    texts: dict[str, str | bytes] = {**likeness_texts(sides, looks), LOOKS_FILE: looks_text(looks)}
    if pictures:
        licensed = [Pictured(each.path, each.name, True) for each in drawable_folders(folders)]
        drawn = [Pictured(each, each.name, False) for each in made["field"]]
        texts |= draw_pictures([*licensed, *drawn], pictures, seed)
    for path in write_texts(texts, results):
        yield f"wrote {path}"
