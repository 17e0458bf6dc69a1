"""`armlab paper does-it-help`: make the trajectories, identify from each, write tables, figures and page."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from joblib import Parallel, delayed

from armlab.common.files import write_whole
from bench.studies.best_known.records import RECORDS_FILE, read_records
from bench.studies.does_it_help.help_page import draw_correlations, draw_errors, study_page
from bench.studies.does_it_help.judgement import SUBSETS, Jury, choose_jury, correlation_table, judge_specimen
from bench.studies.does_it_help.trajectories import Specimen, make_specimens, unit_column_specimens
from bench.tables import as_csv

FILE_STEM = "does_it_help"
SEED = 2024
REPETITIONS = 20


def make_does_it_help(results: Path, workers: int) -> list[Path]:
    """Write `results`/paper/does_it_help.* from the best known records in `results`; returns the files.

    The results do not depend on the number of workers. Raises InputError, in one line, if there is no record.
    """
    records = read_records(results / RECORDS_FILE)
    chosen, beside = make_specimens(SEED, records), unit_column_specimens(records)
    problem = chosen[0].problem
    frame = judge_all([*chosen, *beside], choose_jury(problem, SEED), workers)
    sample, rest = frame.iloc[: len(chosen)], frame.iloc[len(chosen) :]
    table = correlation_table(sample, SEED)
    files: dict[str, str | bytes] = {
        f"{FILE_STEM}.csv": as_csv(frame),
        f"{FILE_STEM}_correlations.csv": as_csv(table),
        f"{FILE_STEM}.md": study_page(sample, table, rest, len(problem.base), REPETITIONS),
        **{f"{FILE_STEM}.{suffix}": image for suffix, image in draw_errors(sample).items()},
    }
    for subset in SUBSETS:
        images = draw_correlations(table, subset)
        files |= {f"{FILE_STEM}_{subset}.{suffix}": image for suffix, image in images.items()}
    folder = results / "paper"
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]


def judge_all(chosen: Sequence[Specimen], panel: Jury, workers: int) -> pd.DataFrame:
    """One row a specimen, in their order."""
    rows = Parallel(n_jobs=workers)(delayed(judge_specimen)(specimen, panel, SEED, REPETITIONS) for specimen in chosen)
    return pd.DataFrame(rows)
