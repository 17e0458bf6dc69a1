"""The commands of the truth machine, without any logic of their own."""

from pathlib import Path

import click

_FOLDER = click.Path(path_type=Path)


@click.command()
@click.option("--cases", type=click.IntRange(min=1), required=True, help="How many recordings.")
@click.option("--seed", type=int, required=True, help="1000-1999 are for development.")
@click.option("--tier", type=click.Choice(["clean", "realistic", "both"]), default="both", show_default=True)
@click.option("--kind", type=click.Choice(["mixed", "nulls"]), default="mixed", show_default=True)
@click.option("--development", is_flag=True, help="Leave out what is kept for judged sets.")
@click.option("--jobs", type=int, default=1, show_default=True, help="Processes.")
@click.option("--out", type=_FOLDER, required=True, help="Folder for observations, truth and manifest.")
def conceal(cases: int, seed: int, tier: str, kind: str, development: bool, jobs: int, out: Path) -> None:
    """Make recordings with hidden effects, and seal the answers (extra `engines`)."""
    from tqdm import tqdm

    from concealed.manifest import NAME, digest
    from concealed.sets import conceal as make
    from concealed.sets import settings_for

    settings = settings_for(cases, seed, tier, kind, development)
    for _ in tqdm(make(settings, out, jobs), total=cases, unit="case", desc="concealed"):
        pass
    click.echo(f"{out / NAME} SHA-256 {digest(out / NAME)}")


@click.command()
@click.argument("folder", type=_FOLDER)
@click.option("--verdicts", type=_FOLDER, required=True, help="Folder with a verdict.json a case.")
@click.option("--manifest", help="SHA-256 that `conceal` printed.")
@click.option("--out", type=_FOLDER, help="Folder for the score [default: VERDICTS/score].")
def score(folder: Path, verdicts: Path, manifest: str | None, out: Path | None) -> None:
    """Compare verdicts with the sealed answers of the concealed set in FOLDER."""
    from concealed.score.command import lines
    from concealed.score.command import score as count

    for line in lines(count(folder, verdicts, manifest, out or verdicts / "score")):
        click.echo(line)


@click.command()
@click.option("--quick", is_flag=True, help="24 cases of a fixed development seed, kept out of the log.")
@click.option("--development", type=int, metavar="SEED", help="Sets of a development seed, kept out of the log.")
@click.option("--cases", type=click.IntRange(min=0), default=400, show_default=True, help="Mixed cases, both tiers.")
@click.option("--nulls", type=click.IntRange(min=0), default=600, show_default=True, help="Cases with nothing hidden.")
@click.option("--work", type=_FOLDER, help="Folder for sets and verdicts [default: .armlab/proof/<commit>].")
@click.option("--results", type=_FOLDER, help="Folder for scores [default: results/proof].")
@click.option("--jobs", type=int, default=-1, show_default=True, help="Processes.")
def prove(
    quick: bool, development: int | None, cases: int, nulls: int, work: Path | None, results: Path | None, jobs: int
) -> None:
    """Conceal, diagnose blindly, score, and log; what was interrupted goes on (extra `engines`)."""
    from concealed.prove import chosen_proof
    from concealed.prove import prove as run

    proof = chosen_proof(quick, development, cases, nulls)
    folder = work or Path(".armlab/proof") / proof.name
    scores = results or (Path("results/proof") if proof.commit else folder / "score")
    for line in run(proof, folder, scores, jobs):
        click.echo(line)
