"""Commands on concealed sets: `armlab conceal`, `armlab score`, and what anyone could name of one."""

import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines, prints_result
from armlab.common.documents import ResultLines

_PATH = click.Path(path_type=Path)


@click.command()
@click.option("--cases", type=click.IntRange(min=1), required=True, help="How many recordings.")
@click.option("--seed", type=int, required=True, help="1000-1999 are for development.")
@click.option("--tier", type=click.Choice(["clean", "realistic", "both"]), default="both", show_default=True)
@click.option("--kind", type=click.Choice(["mixed", "nulls"]), default="mixed", show_default=True)
@click.option("--development", is_flag=True, help="Leave out the kinds of noise of judged sets.")
@click.option("--jobs", type=JobCount(), default=1, show_default=True, help="Processes.")
@click.option("--out", type=OutputPath(), required=True, help="Folder for observations, truth and manifest.")
@prints_result
def conceal(
    cases: int,
    seed: int,
    tier: Literal["clean", "realistic", "both"],
    kind: Literal["mixed", "nulls"],
    development: bool,
    jobs: int,
    out: Path,
) -> ResultLines:
    """Make recordings with hidden effects and sealed answers.

    Needs the extra `proof`.
    """
    from tqdm import tqdm

    from armlab.proof.blind.sealed import MANIFEST_FILE
    from armlab.proof.tiers.torque import TORQUE, make_set_settings

    settings = make_set_settings(cases, seed, tier, kind, development)
    for _ in tqdm(TORQUE.conceal(settings, out, jobs), total=cases, unit="case", desc="concealed"):
        pass
    sealed = TORQUE.seal(settings, out)
    yield f"{out / MANIFEST_FILE} SHA-256 {sealed}"
    return {"manifest": out / MANIFEST_FILE, "sha256": sealed}


@click.command()
@click.argument("folder", type=_PATH)
@click.option("--verdicts", type=_PATH, help="Folder with a verdict.json a case.")
@click.option("--manifest", help="SHA-256 that `conceal` printed.")
@click.option("--out", type=OutputPath(), help="Folder for the score [default: VERDICTS/score].")
@prints_result
def score(folder: Path, verdicts: Path | None, manifest: str | None, out: Path | None) -> ResultLines:
    """Score verdicts against the sealed answers of FOLDER.

    FOLDER: a concealed set. Without --verdicts a folder with a score, whose
    page score.md is written again from the tables beside it.
    """
    from armlab.proof.blind.score.scoring import PAGE_FILE, format_lines, score_set, write_page_again

    if verdicts is None:
        if manifest or out:
            raise click.UsageError("--manifest and --out need --verdicts, the folder with a verdict.json a case")
        document = write_page_again(folder)
        yield f"{folder / PAGE_FILE}: written again, nothing was judged anew"
        yield from _write_summary_again(folder.parent)
        return document
    document = score_set(folder, verdicts, manifest, out or verdicts / "score")
    yield from format_lines(document)
    return document


@click.command()
@click.option("--cases", type=click.IntRange(min=1), required=True, help="How many cases of the set.")
@click.option("--seed", type=int, required=True, help="Of the set.")
@click.option("--tier", type=click.Choice(["clean", "realistic", "both"]), default="both", show_default=True)
@click.option("--development", is_flag=True, help="A set for development.")
@click.option("--score", "scored", type=_PATH, help="Folder with the score of a diagnosis of the same set.")
@click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes.")
@click.option("--asked", type=click.IntRange(min=1), help="How many of them, drawn at random [default: all].")
@click.option("--work", type=OutputPath(), help="Folder for answers; an interrupted command continues there.")
@click.option("--out", type=OutputPath(), help="Folder for oracle.csv and oracle.md [default: that of --score].")
@prints_lines
def oracle(
    cases: int,
    seed: int,
    tier: Literal["clean", "realistic", "both"],
    development: bool,
    scored: Path | None,
    jobs: int,
    asked: int | None,
    work: Path | None,
    out: Path | None,
) -> Iterator[str]:
    """Ask what anyone could name of a concealed set.

    Simulates the set again and compares every hidden effect with all laws, of the library and outside it (extra
    `proof`). In the folder of a score, the distance to the oracle is added to its page.
    """
    from tqdm import tqdm

    from armlab.proof.blind.score.scoring import PAGE_FILE, SCORE_FILE, write_page_again
    from armlab.proof.tiers.naming_oracle_page import (
        ask_about_set,
        collect_answers,
        draw_cases,
        read_scored_effects,
        write_oracle,
    )
    from armlab.proof.tiers.torque import make_set_settings

    out = out or scored
    if out is None:
        raise click.UsageError("--out or --score is needed, the folder for oracle.csv and oracle.md")
    if asked is not None and asked > cases:
        raise click.UsageError(f"--asked {asked} is more than --cases {cases}: give {cases} or less")
    settings = make_set_settings(cases, seed, tier, "mixed", development)
    effects = None if scored is None else read_scored_effects(settings, scored)
    answers = work or Path(".armlab/oracle") / str(seed)
    numbers = draw_cases(settings, asked or cases)
    for _ in tqdm(ask_about_set(settings, numbers, answers, jobs), total=len(numbers), unit="case", desc="asked"):
        pass
    for path in write_oracle(collect_answers(settings, numbers, answers), (len(numbers), cases), effects, out):
        yield f"wrote {path}"
    if (out / SCORE_FILE).is_file():
        write_page_again(out)
        yield f"{out / PAGE_FILE}: written again with the distance to the oracle"
        yield from _write_summary_again(out.parent)
    if work is None and len(numbers) == cases:  # a folder of the user's own may hold more
        shutil.rmtree(answers)


def _write_summary_again(results: Path) -> Iterator[str]:
    """Of a folder of judged results, which has a log; other folders have no summary."""
    from armlab.proof.blind.log_page import LOG_FILE
    from armlab.proof.tiers.summary_page import write_summary

    if (results / LOG_FILE).is_file():
        yield f"wrote {write_summary(results)}"
