"""Commands `armlab proof ...` that learn and measure on development sets."""

from collections.abc import Iterator
from pathlib import Path

import click

from armlab.cli.options import JobCount, OutputPath
from armlab.cli.output import prints_lines, tell_progress

_PATH = click.Path(path_type=Path)


@click.command()
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
    help="Folder `motion` of `armlab proof run --tier motion --development SEED`; may be given more than once.",
)
@click.option(
    "--real",
    "real_sets",
    type=_PATH,
    multiple=True,
    metavar="TABLES",
    help="Folder `real/tables` of `armlab proof run --tier real --development SEED`; may be given more than once.",
)
@click.option(
    "--beside",
    is_flag=True,
    help="Keep the weights that the diagnosis has, and learn those of numbers that it has none of.",
)
@click.option("--out", type=OutputPath(), required=True, help="Folder for calibration.json and calibration.md.")
@prints_lines
def calibrate_names(
    sets: tuple[tuple[Path, Path], ...],
    motion_sets: tuple[Path, ...],
    real_sets: tuple[Path, ...],
    beside: bool,
    out: Path,
) -> Iterator[str]:
    """Learn the probabilities of names from concealed sets.

    Uses development sets alone, and checks the probabilities on cases that are left out in turn, of real recordings all
    of one together (extra `proof`).
    """
    from armlab.diagnosis.choice import Example
    from armlab.diagnosis.torque.names.decide import calibrated_weights, sets_of_weights
    from armlab.proof.blind.real.real_names import read_weighed_real
    from armlab.proof.blind.score.weighed_names import read_weighed
    from armlab.proof.blind.servo.servo_score import read_weighed_motion
    from armlab.proof.open.calibration.calibrate import ExampleFinding, calibrate
    from armlab.proof.open.calibration.calibration_page import calibration_lines, write_calibration

    if not sets and not motion_sets and not real_sets:
        raise click.UsageError("nothing to learn from: give --set SET VERDICTS, --motion WORK or --real TABLES")
    simulated = [*(read_weighed(*each) for each in sets), *(read_weighed_motion(each) for each in motion_sets)]
    real = [read_weighed_real(each) for each in real_sets]
    sources = [about for about, _ in (*simulated, *real)]
    weighed = [(each, "") for _, found in simulated for each in found]
    weighed += [(each, recording) for _, found in real for recording, each in found]
    findings = [
        ExampleFinding(each.case, each.tier, Example(each.names, each.right), each.background, recording)
        for each, recording in weighed
    ]
    found = calibrate(findings, calibrated_weights) if beside else calibrate(findings)
    yield from calibration_lines(found)
    for path in write_calibration(found, sources, out, sets_of_weights() if beside else ()):
        yield f"wrote {path}"


@click.command()
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


@click.command()
@click.option("--work", type=OutputPath(), default=Path(".armlab/recordings"), show_default=True)
@click.option("--out", type=OutputPath(), required=True, help="Folder for bound.json and reading_bound.md.")
@click.option("--jobs", type=JobCount(), default=2, show_default=True, help="Recordings that are read at a time.")
@prints_lines
def calibrate_reading(work: Path, out: Path, jobs: int) -> Iterator[str]:
    """Learn how much a reading mistake has to explain.

    From the best wrong readings of real recordings: the folders below ARMLAB_RECORDINGS, and the public ones, fetched
    into --work. Each arm is judged once more with the bound that the others make, and so are parts of its recordings.
    """
    from armlab.common.errors import InputError
    from armlab.proof.open.likeness.real_arms import real_folders
    from armlab.proof.open.real_folders.reading_bound import (
        best_wrong_readings,
        bound_lines,
        bound_of,
        count_parts,
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
    bound, verdicts = bound_of(readings), list(leave_each_arm_out(readings, tuning, jobs, tell_progress))
    yield from bound_lines(verdicts, bound)
    told, count = share_told(readings, bound)
    arms = f"{len(readings)} recordings and halves of {len(verdicts)} arms"
    yield f"{arms}: bound {bound:.3f}; {told} of {count} mistakes reach it"
    parts, false = count_parts(verdicts)
    yield f"without the arm that is judged: {false} of {parts} parts of recordings are said to hold mistakes"
    for path in write_bound(readings, verdicts, out):
        yield f"wrote {path}"


@click.command()
@click.argument("folder", type=_PATH)
@click.option("--cases", type=click.IntRange(min=1), default=100, show_default=True, help="So many, small arms first.")
@click.option("--repetitions", type=click.IntRange(min=2), default=20, show_default=True, help="As of `diagnose`.")
@click.option("--work", type=OutputPath(), default=Path(".armlab/survival"), show_default=True)
@click.option("--results", type=OutputPath(), default=Path("results/proof"), show_default=True)
@prints_lines
def survival(folder: Path, cases: int, repetitions: int, work: Path, results: Path) -> Iterator[str]:
    """Count how often names that survive are right.

    FOLDER is a concealed development set (`armlab conceal`). Each case is diagnosed with --survival; an interrupted
    command continues.
    """
    from armlab.proof.blind.score.survival import (
        diagnose_with_survival,
        read_survivals,
        survival_rows,
        write_survival,
    )

    done = 0
    for done, name in enumerate(diagnose_with_survival(folder, cases, repetitions, work), 1):
        yield f"  {name}: {done} of at most {cases}"
    found = read_survivals(folder, cases, work)
    yield from (f"{about}: {count} names, right {right}" for about, count, right in survival_rows(found))
    for path in write_survival(
        found, f"{done} development cases, small arms first, {repetitions} times with all findings", results
    ):
        yield f"wrote {path}"


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
    `proof`).
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


@click.command()
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
    name is left (extra `proof`).
    """
    from tqdm import tqdm

    from armlab.cli.second_motion import plan_second_motion
    from armlab.proof.blind.loop.case import Tools
    from armlab.proof.blind.loop.loop_page import Seals, write_page
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
    distributions. Each look is logged (extra `proof`).
    """
    from armlab.common.errors import InputError
    from armlab.common.files import write_texts
    from armlab.proof.blind.sealed import code_commit
    from armlab.proof.open.likeness.likeness_page import likeness_texts
    from armlab.proof.open.likeness.look import (
        LOOKS_FILE,
        compare,
        look_of,
        looks_text,
        read_looks,
        read_real_arms,
        read_simulated_arms,
    )
    from armlab.proof.open.likeness.pictures import Pictured, draw_pictures
    from armlab.proof.open.likeness.real_arms import drawable_folders, real_folders
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
