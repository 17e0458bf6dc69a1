"""The command of the ablation: puts the truth machine and the guards of the diagnosis together."""

from pathlib import Path

import click


@click.command()
@click.option("--seed", type=int, default=1950, show_default=True, help="One for development, 1000-1999.")
@click.option("--cases", type=click.IntRange(min=1), default=50, show_default=True, help="Mixed cases, both tiers.")
@click.option("--nulls", type=click.IntRange(min=1), default=50, show_default=True, help="Cases with nothing hidden.")
@click.option("--work", type=click.Path(path_type=Path), default=Path(".armlab/ablation"), show_default=True)
@click.option("--results", type=click.Path(path_type=Path), default=Path("results/proof"), show_default=True)
@click.option("--jobs", type=int, default=-1, show_default=True, help="Processes.")
def ablate(seed: int, cases: int, nulls: int, work: Path, results: Path, jobs: int) -> None:
    """Diagnose concealed cases with each guard off in turn: what is it worth? (extra `engines`)"""
    from armlab.diagnosis.ablation import verdicts_without_each
    from concealed.ablation import Ablation
    from concealed.ablation import ablate as run

    for line in run(Ablation(seed, cases, nulls), verdicts_without_each, work, results, jobs):
        click.echo(line)
