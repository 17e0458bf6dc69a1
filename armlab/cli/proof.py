"""Commands on concealed cases: make and score them, the proof, the value of each guard, and the closed loop."""

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal, TypeVar

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines, prints_result
from armlab.common.documents import ResultLines

_PATH = click.Path(path_type=Path)
_Command = TypeVar("_Command", bound=Callable[..., Any])


@click.command()
@click.option("--seed", type=int, default=1950, show_default=True, help="A development seed, 1000-1999.")
@click.option("--cases", type=click.IntRange(min=1), default=50, show_default=True, help="Mixed cases, both tiers.")
@click.option("--nulls", type=click.IntRange(min=1), default=50, show_default=True, help="Cases with nothing hidden.")
@click.option("--work", type=_PATH, default=Path(".armlab/ablation"), show_default=True)
@click.option("--results", type=OutputPath(), default=Path("results/proof"), show_default=True)
@click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes.")
@click.option(
    "--vary",
    "changes",
    multiple=True,
    metavar="NUMBER=VALUE",
    help="A tuning number with another value too, like noise.max_order=8.",
)
@prints_lines
def ablate(
    seed: int, cases: int, nulls: int, work: Path, results: Path, jobs: int, changes: tuple[str, ...]
) -> Iterator[str]:
    """Measure what each guard of the diagnosis is worth.

    Diagnoses concealed cases with one guard off at a time, and with one tuning number changed at a time (extra
    `engines`).
    """
    from functools import partial

    from armlab.diagnosis.settings import Settings, vary
    from armlab.diagnosis.tuning import parse_change
    from armlab.proof.open.ablation import verdicts_without_each
    from armlab.proof.tiers.guards import AblationSettings
    from armlab.proof.tiers.guards import ablate as run_ablation

    for change in changes:  # refused before hours of work
        vary(Settings(), *parse_change(change))
    settings = AblationSettings(seed, cases, nulls, changes)
    diagnose = partial(verdicts_without_each, changes=changes)
    return run_ablation(settings, diagnose, work, results, jobs)


@click.command("next-loop")
@click.option("--cases", type=click.IntRange(min=1), default=60, show_default=True, help="How many ambiguous cases.")
@click.option("--seed", type=int, required=True, help="1000-1999 are for development.")
@click.option(
    "--out",
    type=OutputPath(),
    required=True,
    help="Folder for recordings, answers and verdicts; an interrupted loop continues.",
)
@click.option("--results", type=OutputPath(), help="Folder for table and picture [default: OUT/score].")
@click.option("--jobs", type=JobCount(), default=-1, show_default=True, help="Processes.")
@prints_lines
def next_loop(cases: int, seed: int, out: Path, results: Path | None, jobs: int) -> Iterator[str]:
    """Measure how well a second motion decides between rivals.

    Makes ambiguous recordings, diagnoses them, adds a second motion, diagnoses both, and counts how often the right
    name is left (extra `engines`).
    """
    from tqdm import tqdm

    from armlab.cli.second_motion import plan_second_motion
    from armlab.proof.blind.loop.case import Tools
    from armlab.proof.blind.loop.page import Seals, write_page
    from armlab.proof.blind.loop.run import LoopSettings, close_loop, play_cases, read_results, seal_loop
    from armlab.proof.open.second_motion import suspect_rivals, write_diagnosis

    settings = LoopSettings(cases, seed)
    answers = seal_loop(settings, out)
    yield f"sealed {out / 'truth'}, SHA-256 of the answers {answers}"
    tools = Tools(write_diagnosis, suspect_rivals, plan_second_motion)
    for _ in tqdm(play_cases(settings, out, tools, jobs), total=cases, unit="case"):
        pass
    manifest = close_loop(settings, out, answers)
    for path in write_page(settings, read_results(settings, out), Seals(answers, manifest), results or out / "score"):
        yield f"wrote {path}"


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

    Needs the extra `engines`.
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
    `engines`). In the folder of a score, the distance to the oracle is added to its page.
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


def _write_summary_again(results: Path) -> Iterator[str]:
    """Of a folder of judged results, which has a log; other folders have no summary."""
    from armlab.proof.blind.log_page import LOG_FILE
    from armlab.proof.tiers.summary_page import write_summary

    if (results / LOG_FILE).is_file():
        yield f"wrote {write_summary(results)}"


@click.command("calibrate")
@click.option(
    "--set",
    "sets",
    type=(_PATH, _PATH),
    multiple=True,
    metavar="SET VERDICTS",
    help="A concealed development set and its verdicts; may be given more than once.",
)
@click.option(
    "--motion",
    "motion_sets",
    type=_PATH,
    multiple=True,
    metavar="WORK",
    help="Folder of `armlab prove-motion --seed SEED`; may be given more than once.",
)
@click.option(
    "--real",
    "real_sets",
    type=_PATH,
    multiple=True,
    metavar="TABLES",
    help="Output folder of `armlab real-concealed --seed SEED`; may be given more than once.",
)
@click.option("--out", type=OutputPath(), required=True, help="Folder for calibration.json and calibration.md.")
@prints_lines
def calibrate_names(
    sets: tuple[tuple[Path, Path], ...], motion_sets: tuple[Path, ...], real_sets: tuple[Path, ...], out: Path
) -> Iterator[str]:
    """Learn the probabilities of names from concealed sets.

    Uses development sets alone, and checks the probabilities on cases that are left out in turn, of real recordings all
    of one together (extra `dev`).
    """
    from armlab.diagnosis.torque.names.choice import Example
    from armlab.proof.blind.real.weighed import read_weighed_real
    from armlab.proof.blind.score.weighed import read_weighed
    from armlab.proof.blind.servo.score import read_weighed_motion
    from armlab.proof.open.calibration.calibrate import Finding, calibrate
    from armlab.proof.open.calibration.calibration_page import calibration_lines, write_calibration

    if not sets and not motion_sets and not real_sets:
        raise click.UsageError("nothing to learn from: give --set SET VERDICTS, --motion WORK or --real TABLES")
    simulated = [*(read_weighed(*each) for each in sets), *(read_weighed_motion(each) for each in motion_sets)]
    real = [read_weighed_real(each) for each in real_sets]
    sources = [about for about, _ in (*simulated, *real)]
    weighed = [(each, "") for _, found in simulated for each in found]
    weighed += [(each, recording) for _, found in real for recording, each in found]
    findings = [
        Finding(each.case, each.tier, Example(each.names, each.right), each.background, recording)
        for each, recording in weighed
    ]
    found = calibrate(findings)
    yield from calibration_lines(found)
    for path in write_calibration(found, sources, out):
        yield f"wrote {path}"


@click.command("calibrate-unknown")
@click.option(
    "--claims",
    type=_PATH,
    multiple=True,
    required=True,
    help="claims.csv of a judged set of an earlier engine, named after its commit; give two or more.",
)
@click.option("--check", "unseen", type=_PATH, multiple=True, help="The same of a set that has no part in the limit.")
@click.option("--out", type=OutputPath(), required=True, help="Folder for unknown_limit.json and unknown.md.")
@prints_lines
def calibrate_unknown(claims: tuple[Path, ...], unseen: tuple[Path, ...], out: Path) -> Iterator[str]:
    """Learn how sure a finding may be that it is unknown.

    From judged sets of earlier engines, which judge no more; each is left out in turn to see what the limit does.
    """
    from armlab.proof.blind.score.unknown_limit import check_limit, limit_lines, limit_of, read_claims, write_limit

    learnt = [read_claims(each) for each in claims]
    scores = check_limit(learnt, [read_claims(each) for each in unseen])
    limit = limit_of(learnt)
    yield f"{limit.right} of {limit.findings} sure findings without a name were right: limit {limit.value:.2f}"
    yield from limit_lines(scores)
    for path in write_limit(learnt, scores, out):
        yield f"wrote {path}"


@click.command("calibrate-reading")
@click.option("--work", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--out", type=OutputPath(), required=True, help="Folder for bound.json and reading_bound.md.")
@prints_lines
def calibrate_reading(work: Path, out: Path) -> Iterator[str]:
    """Learn how much a reading mistake has to explain.

    From the best wrong readings of real recordings: the folders below ARMLAB_RECORDINGS, and the public ones, fetched
    into --work. Each arm is judged once more with the bound that the others make.
    """
    from armlab.common.errors import InputError
    from armlab.proof.open.likeness.real_arms import real_folders
    from armlab.proof.open.real_folders.reading_bound import (
        best_wrong_readings,
        bound_lines,
        bound_of,
        leave_each_arm_out,
        share_told,
        write_bound,
    )
    from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_copies
    from armlab.recordings.reading.tuning import ReadingTuning

    local, tuning = local_copies(), ReadingTuning()
    if local is None:
        raise InputError(f"no recording folders: {LOCAL_COPIES_VARIABLE} names none")
    readings = list(best_wrong_readings(list(real_folders(local, work)), tuning))
    bound, verdicts = bound_of(readings), list(leave_each_arm_out(readings, tuning))
    yield from bound_lines(verdicts, bound)
    told, count = share_told(readings, bound)
    yield f"{len(readings)} recordings of {len(verdicts)} arms: bound {bound:.3f}; {told} of {count} mistakes reach it"
    for path in write_bound(readings, verdicts, out):
        yield f"wrote {path}"


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


def _choose_set(seed: int | None, work: Path | None, kind: str) -> tuple[int, Path, str | None]:
    """The seed of a sealed set, which follows from the commit, and its folder, where they are not given.

    The third is the commit that the set judges, None for any other seed.
    """
    from armlab.proof.blind.sealed import code_commit, judged_commit, judged_seed

    chosen = judged_seed(code_commit()) if seed is None else seed
    return chosen, work or Path(f".armlab/{kind}/{chosen}"), judged_commit(chosen)


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


@click.command("prove-changes")
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


@click.command("prove-field")
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


@click.command("prove-setup")
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


@click.command("prove-motion")
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
