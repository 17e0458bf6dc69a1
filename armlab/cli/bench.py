"""Commands `armlab bench ...`: what there is, results of comparisons, tuning, best known trajectories."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import click

from armlab.cli.experiments import PATH, store_option
from armlab.cli.options import FiniteNumber, OutputPath
from armlab.cli.output import prints_lines, prints_result, trial_bar
from armlab.cli.safety_options import safety_options
from armlab.common.documents import Document, ResultLines, written_files

_RESULTS_OPTION = click.option("--results", type=OutputPath(), default=Path("results"), show_default=True)
_RECORDS_OPTION = click.option(
    "--records",
    type=PATH,
    default=Path("results/best_known.json"),
    show_default=True,
    help="File of the best known trajectories.",
)


@click.command()
@prints_result
def list_names() -> ResultLines:
    """List the algorithms, problems and arms by their names.

    A configuration uses these names.
    """
    from algorithms import registry as algorithms
    from problem import registry as problems
    from problem.robot_file import built_in_arms

    document: Document = {
        "algorithms": algorithms.names(),
        "peers": algorithms.peer_names(),
        "with_derivatives": algorithms.names_with_derivatives(),
        "problems": problems.names(),
        "suites": {suite: problems.instances(suite) for suite in problems.suites()},
        "arms": built_in_arms(),
    }
    yield "algorithms: " + ", ".join(document["algorithms"])
    yield "peers (extra `peers`): " + ", ".join(document["peers"])
    yield "with derivatives: " + ", ".join(document["with_derivatives"])
    yield "problems: " + ", ".join(document["problems"])
    for suite, members in document["suites"].items():
        yield f"suite {suite}: {len(members)} problems, {members[0]} the first"
    yield "arms: " + ", ".join(document["arms"])
    return document


@click.command()
@click.argument("first", type=PATH)
@click.argument("second", type=PATH)
@store_option
@click.option("--out", type=OutputPath(), help="Folder for comparison.md and .csv [default: print only].")
@prints_result
def compare(first: Path, second: Path, store: Path, out: Path | None) -> ResultLines:
    """Show what changed between two sets of results.

    Compares SECOND with FIRST, algorithm by algorithm and problem by problem. Each is a configuration file whose
    trials were run, or a folder that `bench share` wrote.
    """
    from bench.result_sets.compare import compare_results

    return compare_results(first, second, store, out)


@click.command()
@click.argument("results", type=PATH)
@store_option
@click.option(
    "--as",
    "form",
    type=click.Choice(["csv", "parquet", "ioh", "latex", "pdf", "svg"]),
    default="csv",
    show_default=True,
)
@click.option("--out", type=OutputPath(), required=True, help="Folder to write into.")
@prints_result
def share(results: Path, store: Path, form: str, out: Path) -> ResultLines:
    """Write RESULTS as tables or in IOHprofiler's format.

    csv, parquet: tidy tables. ioh: the format of IOHprofiler. latex (booktabs), pdf, svg: the summary as a table.
    RESULTS: a configuration file whose trials were run, or a folder that `bench share` wrote.
    """
    from bench.result_sets.formats import share_results

    return written_files(share_results(results, store, form, out))


@click.command()
@click.argument("results", type=PATH)
@store_option
@click.option("--out", type=PATH, required=True, help="Folder to write into.")
@_RECORDS_OPTION
@click.option(
    "--as",
    "formats",
    type=click.Choice(["png", "svg", "pdf"]),
    multiple=True,
    default=("svg",),
    show_default=True,
    help="Repeatable.",
)
@prints_result
def draw(results: Path, store: Path, out: Path, records: Path, formats: tuple[str, ...]) -> ResultLines:
    """Draw RESULTS: ends, ranking, budgets.

    Writes every end with median and best known, the ranks over problems, and the medians against the
    budget, as they fit. RESULTS: a configuration file whose trials were run, or a folder that `bench share` wrote.
    """
    from bench.result_sets.draw import draw_results

    return written_files(draw_results(results, store, records, out, formats))


@click.command()
@click.argument("results", type=PATH)
@click.argument("algorithm")
@store_option
@click.option("--out", type=OutputPath(), required=True, help="Folder to write into.")
@prints_result
def duels(results: Path, algorithm: str, store: Path, out: Path) -> ResultLines:
    """Compare ALGORITHM with every other of RESULTS.

    Writes effect sizes (A12) with intervals, corrected tests and their power. ALGORITHM: its label. RESULTS: a
    configuration file whose trials were run, or a folder that `bench share` wrote.
    """
    from bench.result_sets.duels import write_duels

    return written_files(write_duels(results, store, algorithm, out))


@click.command()
@click.argument("parts", type=PATH, nargs=-1, required=True)
@click.option("--out", type=OutputPath(), required=True, help="File of the new store, or the new folder.")
@click.option("--any-versions", is_flag=True, help="Join parts of different versions or kinds of processor, too.")
@prints_result
def merge(parts: tuple[Path, ...], out: Path, any_versions: bool) -> ResultLines:
    """Join PARTS of results into one.

    PARTS: run stores of several machines, or folders that `bench share` wrote as tables. A trial that several parts
    have counts once.
    """
    from bench.result_sets.join import join_parts

    return join_parts(parts, out, any_versions)


@click.command()
@click.argument("damaged", type=PATH)
@click.option("--out", type=OutputPath(), required=True, help="File of the new store.")
@prints_result
def salvage(damaged: Path, out: Path) -> ResultLines:
    """Copy what is readable of a DAMAGED run store.

    The copy is a new store; the next run computes what it lacks.
    """
    from bench.store import salvage as save

    count = save(damaged, out)
    yield f"{count} outcomes of {damaged} are in {out}"
    return {"outcomes": count, "files": [out]}


@click.command()
@click.argument("algorithms", nargs=-1)
@click.option("--config", type=PATH, default=Path("configs/tune.yaml"), show_default=True)
@click.option("--budget", type=click.IntRange(min=2), help="Configurations an algorithm [default: the file's].")
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core].")
@store_option
@click.option("--results", type=click.Path(path_type=Path), default=Path("results/tune"), show_default=True)
@click.option("--overwrite", is_flag=True, help="Replace results of other settings.")
@prints_result
def tune(
    algorithms: tuple[str, ...],
    config: Path,
    budget: int | None,
    workers: int | None,
    store: Path,
    results: Path,
    overwrite: bool,
) -> ResultLines:
    """Tune ALGORITHMS, the same budget for each [default: all].

    Tries hyper-parameters on training problems and judges the best ones on problems that took no part, beside the
    published ones. You can stop it at any time; the next call continues from there. Needs the extra `peers`.
    """
    from joblib import cpu_count

    from bench.studies.tuning.tuning_study import TuningOptions, tune_algorithms

    records = Path("results/best_known.json")
    options = TuningOptions(algorithms, budget, store, results, records, workers or cpu_count(), overwrite)
    return written_files(tune_algorithms(config, options, trial_bar))


@click.command()
@click.argument("algorithms", nargs=-1)
@click.option("--results", type=OutputPath(), default=Path("results/properties"), show_default=True)
@prints_result
def properties(algorithms: tuple[str, ...], results: Path) -> ResultLines:
    """Measure general properties of ALGORITHMS [default: all].

    Behaviour under translation, scale and noise, use of the bounds, and overhead. Writes properties.md and
    properties.csv.
    """
    from bench.studies.properties import write_properties

    return written_files(write_properties(algorithms, results))


@click.command()
@click.option("--out", type=OutputPath(), default=Path("results/landscape"), show_default=True, help="Folder to write.")
@click.option("--workers", type=click.IntRange(min=1), help="Number of processes [default: one a core].")
@click.option(
    "--store",
    type=PATH,
    default=Path(".armlab/landscape"),
    show_default=True,
    help="Folder that keeps what was measured.",
)
@click.option("--pages", is_flag=True, help="Measure nothing: new pages from the tables in --out.")
@_RESULTS_OPTION
@prints_result
def landscape(out: Path, workers: int | None, store: Path, pages: bool, results: Path) -> ResultLines:
    """Say what makes an algorithm win, and which to take.

    Measures features of each problem of the suites, correlates them with the standings of the algorithms in --results,
    and writes the page that says which optimiser to take. You can stop it at any time; the next call continues from
    there.
    """
    from joblib import cpu_count

    from bench.studies.landscape.landscape_study import LandscapeOptions, make_landscape

    options = LandscapeOptions(results, out, store, workers or cpu_count(), pages)
    return written_files(make_landscape(options, trial_bar))


@click.command()
@click.option("--minutes", type=FiniteNumber(min=0), default=10.0, show_default=True)
@click.option("--problem", help="Name of a problem in configs/best_known.yaml [default: all in turn].")
@_RESULTS_OPTION
@prints_lines
def best_known(minutes: float, problem: str | None, results: Path) -> Iterator[str]:
    """Search for better trajectories than the best known.

    Updates best_known.json. You can stop the search at any time; the next call continues from there.
    """
    from bench.studies.best_known.search import improve_best_known

    return improve_best_known(results, minutes, problem)


@click.command()
@_RECORDS_OPTION
@click.option("--results", type=OutputPath(), default=Path("results/published"), show_default=True)
@prints_result
def published(records: Path, results: Path) -> ResultLines:
    """Judge published trajectories beside the best known.

    Recomputes the condition numbers of the trajectories in configs/published.yaml and writes published.md, and the
    table of records, records.md.
    """
    from bench.studies.best_known.published import write_published

    return written_files(write_published(results, records))


@click.command()
@click.argument("submission", type=click.Path(path_type=Path))
@_RECORDS_OPTION
@prints_result
def submit(submission: Path, records: Path) -> ResultLines:
    """Recompute and verify a trajectory of yours beside a record.

    SUBMISSION: a YAML file with problem, coefficients and by. Refuses a motion that breaks a limit or comes too close
    to itself or a floor at any instant, else prints its row for the table of records. Writes nothing.
    """
    from bench.studies.best_known.submit import judge_submission

    return judge_submission(submission, records)


@click.command()
@click.argument("problem", type=click.Path(path_type=Path))
@click.option("--record", required=True, help="Name of a record in best_known.json.")
@click.option("--format", "form", type=click.Choice(["csv", "ros2", "rapid"]), default="csv", show_default=True)
@click.option(
    "--rate",
    "rate_hz",
    type=FiniteNumber(min=1, max=100_000),
    default=250.0,
    show_default=True,
    help="Sampling rate, Hz.",
)
@click.option("--out", type=OutputPath(), required=True)
@click.option("--recording", type=PATH, help="The motion stays near its range and starts near its first pose.")
@_RESULTS_OPTION
@safety_options
@prints_result
def export(
    problem: Path,
    record: str,
    form: str,
    rate_hz: float,
    out: Path,
    recording: Path | None,
    results: Path,
    safety: Any,
) -> ResultLines:
    """Write a best known trajectory for a robot controller.

    Refuses a trajectory that breaks a limit of PROBLEM at the controller's rate, that comes too close to itself, the
    floor or a box, or that leaves the range or the pose that are given. Says what was checked and what was not.
    """
    from bench.studies.best_known.export import export_record as write
    from bench.studies.best_known.records import RECORDS_FILE

    place = None if recording is None else _read_place(recording)
    exported = write(problem, record, form, out, results / RECORDS_FILE, rate_hz, safety, place)
    yield from exported.safety.lines()
    document = yield from written_files([out])
    return {**document, "safety": exported.safety.content()}


def _read_place(recording: Path) -> Any:
    """Where a recording was."""
    from armlab.diagnosis.next.motion import recorded_place
    from armlab.recordings.load import load_recording

    return recorded_place(load_recording(recording))
