"""The command `armlab proof run`: the whole proof, or some of its tiers, of any size."""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines

if TYPE_CHECKING:
    from armlab.proof.tiers.tiers import TierName

_PATH = click.Path(path_type=Path)


@click.command()
@click.option(
    "--tier",
    "tiers",
    type=click.Choice(["torque", "setup", "motion", "real", "changes", "field"]),
    multiple=True,
    help="Only this tier; may be given more than once [default: torque, setup, motion and real].",
)
@click.option("--quick", is_flag=True, help="A few cases of each tier, of a fixed development seed, not logged.")
@click.option("--development", type=int, metavar="SEED", help="Sets of a development seed, not logged.")
@click.option(
    "--size",
    "sizes",
    type=(str, click.IntRange(min=0)),
    multiple=True,
    metavar="KIND COUNT",
    help="So many cases of a kind, such as `nulls 100`: torque and motion have cases, nulls; setup simulated, real, "
    "nulls; real cases; changes changed, nulls, field_changed, field_nulls; field cases, nulls, mistakes. May be given "
    "more than once.",
)
@click.option(
    "--folder",
    "folders",
    multiple=True,
    metavar="NAME",
    help="A recording below ARMLAB_RECORDINGS for the tiers setup (with a D-H table) and real, beside the public ones; "
    "may be given more than once.",
)
@click.option("--work", type=_PATH, help="Folder for sets and verdicts [default: .armlab/proof/<commit>].")
@click.option("--results", type=OutputPath(), help="Folder for scores [default: results/proof].")
@click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes.")
@prints_lines
def prove(
    tiers: tuple["TierName", ...],
    quick: bool,
    development: int | None,
    sizes: tuple[tuple[str, int], ...],
    folders: tuple[str, ...],
    work: Path | None,
    results: Path | None,
    jobs: int,
) -> Iterator[str]:
    """Prove the diagnosis: conceal, diagnose blindly, score.

    Tier by tier: torque, how recordings are read (setup), motion only, real recordings with something concealed; where
    asked for, what changed between recordings, and recordings that resemble real ones (field). Logs the scores. After
    an interruption the same command continues (extra `proof`).
    """
    from armlab.proof.tiers.tiers import USUAL_TIERS, choose_proof, prove_tiers

    proof = choose_proof(quick, development, dict(sizes), folders)
    folder = work or Path(".armlab/proof") / proof.name
    scores = results or (Path("results/proof") if proof.commit else folder / "score")
    return prove_tiers(proof, tiers or USUAL_TIERS, folder, scores, jobs)
