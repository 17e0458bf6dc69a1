"""Commands `armlab proof ...` of sealed tiers: the whole proof, or one tier with sizes of its own."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, TypeVar

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines

_PATH = click.Path(path_type=Path)
_Command = TypeVar("_Command", bound=Callable[..., Any])


@click.command()
@click.option("--quick", is_flag=True, help="A few cases of each tier, of a fixed development seed, not logged.")
@click.option("--development", type=int, metavar="SEED", help="Sets of a development seed, not logged.")
@click.option("--cases", type=click.IntRange(min=0), default=400, show_default=True, help="Mixed torque cases.")
@click.option("--nulls", type=click.IntRange(min=0), default=600, show_default=True, help="Torque nulls.")
@click.option("--work", type=_PATH, help="Folder for sets and verdicts [default: .armlab/proof/<commit>].")
@click.option("--results", type=OutputPath(), help="Folder for scores [default: results/proof].")
@click.option(
    "--tier",
    "tiers",
    type=click.Choice(["torque", "setup", "motion", "real"]),
    multiple=True,
    help="Only this tier; may be given more than once [default: all].",
)
@click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes.")
@prints_lines
def prove(
    quick: bool,
    development: int | None,
    cases: int,
    nulls: int,
    work: Path | None,
    results: Path | None,
    tiers: tuple[Literal["torque", "setup", "motion", "real"], ...],
    jobs: int,
) -> Iterator[str]:
    """Prove the diagnosis: conceal, diagnose blindly, score.

    Tier by tier: torque, how recordings are read, motion only, real recordings with something concealed. Logs the
    scores. After an interruption the same command continues (extra `engines`).
    """
    from armlab.proof.tiers.tiers import TIERS, prove_tiers
    from armlab.proof.tiers.torque import choose_proof

    proof = choose_proof(quick, development, cases, nulls)
    folder = work or Path(".armlab/proof") / proof.name
    scores = results or (Path("results/proof") if proof.commit else folder / "score")
    return prove_tiers(proof, tiers or TIERS, folder, scores, jobs)


def _sealed_set_options(kind: str, contents: str) -> Callable[[_Command], _Command]:
    """Seed, folders and processes of a sealed set."""
    options = (
        click.option("--seed", type=int, help="1000-1999 are for development [default: follows from the commit]."),
        click.option("--work", type=_PATH, help=f"Folder for {contents} and verdicts [default: .armlab/{kind}/SEED]."),
        click.option(
            "--results", type=OutputPath(), help=f"Folder for {kind}.md and {kind}.json [default: WORK/score]."
        ),
        click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes."),
    )

    def decorate(command: _Command) -> _Command:
        for option in reversed(options):
            command = option(command)
        return command

    return decorate


@click.command()
@click.option("--simulated", type=click.IntRange(min=0), default=300, show_default=True, help="Simulated recordings.")
@click.option("--real", type=click.IntRange(min=0), default=200, show_default=True, help="Public recordings.")
@click.option("--nulls", type=click.IntRange(min=0), default=300, show_default=True, help="Nothing is wrong.")
@click.option(
    "--folder",
    "folders",
    multiple=True,
    metavar="NAME",
    help="A recording with a D-H table below ARMLAB_RECORDINGS, beside the public ones, repeatable.",
)
@_sealed_set_options("setup", "cases")
@prints_lines
def prove_setup(
    simulated: int,
    real: int,
    nulls: int,
    folders: tuple[str, ...],
    seed: int | None,
    work: Path | None,
    results: Path | None,
    jobs: int,
) -> Iterator[str]:
    """Prove that recordings are read rightly.

    Puts mistakes into simulated and public recordings, diagnoses them blindly, and scores: physics, too, where some is
    hidden. After an interruption the same command continues (extra `engines`).
    """
    from armlab.proof.tiers.reading import SETUP, SetupSet

    chosen, folder, commit = _choose_set(seed, work, "setup")
    cases = SetupSet(simulated, real, nulls, chosen, folders)
    return SETUP.prove(cases, folder, results or folder / "score", jobs, commit)


@click.command()
@click.option("--cases", type=click.IntRange(min=0), default=300, show_default=True, help="Something is hidden.")
@click.option("--nulls", type=click.IntRange(min=0), default=300, show_default=True, help="Nothing is hidden.")
@_sealed_set_options("motion", "cases")
@prints_lines
def prove_motion(
    cases: int, nulls: int, seed: int | None, work: Path | None, results: Path | None, jobs: int
) -> Iterator[str]:
    """Prove the diagnosis of recordings of motion only.

    Simulates arms with position servos whose joints stick, on an engine of its own, diagnoses commands and positions
    blindly, and scores. After an interruption the same command continues.
    """
    from armlab.proof.tiers.motion import MOTION, MotionSet

    chosen, folder, commit = _choose_set(seed, work, "motion")
    return MOTION.prove(MotionSet(cases, nulls, chosen), folder, results or folder / "score", jobs, commit)


@click.command()
@click.option("--nulls", type=click.IntRange(min=0), default=300, show_default=True, help="Pairs, nothing changed.")
@click.option("--changed", type=click.IntRange(min=0), default=120, show_default=True, help="Pairs, one thing changed.")
@_sealed_set_options("changes", "pairs")
@prints_lines
def prove_changes(
    nulls: int, changed: int, seed: int | None, work: Path | None, results: Path | None, jobs: int
) -> Iterator[str]:
    """Prove the comparison of recordings.

    Makes pairs of recordings of one robot, with nothing or one thing changed, compares them blindly, and scores. After
    an interruption the same command continues (extra `engines`).
    """
    from armlab.proof.tiers.changes import CHANGES, PairSet

    chosen, folder, commit = _choose_set(seed, work, "changes")
    return CHANGES.prove(PairSet(nulls, changed, chosen), folder, results or folder / "score", jobs, commit)


@click.command()
@click.option("--cases", type=click.IntRange(min=0), default=100, show_default=True, help="Something is hidden.")
@click.option("--nulls", type=click.IntRange(min=0), default=100, show_default=True, help="Nothing but what arms have.")
@click.option("--mistakes", type=click.IntRange(min=0), default=100, show_default=True, help="A reading mistake.")
@click.option("--pairs", type=click.IntRange(min=0), default=60, show_default=True, help="Every other pair is changed.")
@_sealed_set_options("field", "cases")
@prints_lines
def prove_field(
    cases: int,
    nulls: int,
    mistakes: int,
    pairs: int,
    seed: int | None,
    work: Path | None,
    results: Path | None,
    jobs: int,
) -> Iterator[str]:
    """Prove the diagnosis on recordings that resemble real ones.

    Makes recordings with every law at once and a rest that no law explains, diagnoses or compares them blindly, and
    scores physics, reading and changes. After an interruption the same command continues (extra `engines`).
    """
    from armlab.proof.tiers.field import FIELD_TIER, FieldSet

    chosen, folder, commit = _choose_set(seed, work, "field")
    chosen_set = FieldSet(cases, nulls, mistakes, pairs, chosen)
    return FIELD_TIER.prove(chosen_set, folder, results or folder / "score", jobs, commit)


def _choose_set(seed: int | None, work: Path | None, kind: str) -> tuple[int, Path, str | None]:
    """The seed of a sealed set, which follows from the commit, and its folder, where they are not given.

    The third is the commit that the set judges, None for any other seed.
    """
    from armlab.proof.blind.sealed import code_commit, judged_commit, judged_seed

    chosen = judged_seed(code_commit()) if seed is None else seed
    return chosen, work or Path(f".armlab/{kind}/{chosen}"), judged_commit(chosen)
