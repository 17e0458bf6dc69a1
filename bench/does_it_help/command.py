"""What `armlab does-it-help` does: make the trajectories, identify from each, write tables, figures and page."""

from collections.abc import Sequence
from pathlib import Path

import pandas as pd
from joblib import Parallel, delayed

from bench.best_known.record import FILE, read_records
from bench.does_it_help.correlation import SUBSETS, correlations
from bench.does_it_help.draw import draw_correlations, draw_errors
from bench.does_it_help.judgement import Jury, judged, jury
from bench.does_it_help.page import page
from bench.does_it_help.trajectories import Specimen, apart, specimens
from bench.files import write_whole
from bench.table import as_csv

NAME = "does_it_help"
SEED = 2024
REPETITIONS = 20


def does_it_help(results: Path, workers: int) -> list[Path]:
    """Write `results`/paper/does_it_help.* from the best-known records in `results`; returns the files.

    Nothing depends on the number of workers. Raises InputError, in one line, without a record to begin from.
    """
    records = read_records(results / FILE)
    chosen, beside = specimens(SEED, records), apart(records)
    problem = chosen[0].problem
    frame = judged_all([*chosen, *beside], jury(problem, SEED), workers)
    sample, rest = frame.iloc[: len(chosen)], frame.iloc[len(chosen) :]
    table = correlations(sample, SEED)
    files: dict[str, str | bytes] = {
        f"{NAME}.csv": as_csv(frame),
        f"{NAME}_correlations.csv": as_csv(table),
        f"{NAME}.md": page(sample, table, rest, len(problem.base), REPETITIONS),
        **{f"{NAME}.{suffix}": image for suffix, image in draw_errors(sample).items()},
    }
    for subset in SUBSETS:
        images = draw_correlations(table, subset)
        files |= {f"{NAME}_{subset}.{suffix}": image for suffix, image in images.items()}
    folder = results / "paper"
    folder.mkdir(parents=True, exist_ok=True)
    for name, content in files.items():
        write_whole(folder / name, content)
    return [folder / name for name in files]


def judged_all(chosen: Sequence[Specimen], panel: Jury, workers: int) -> pd.DataFrame:
    """One row a specimen, in their order."""
    rows = Parallel(n_jobs=workers)(delayed(judged)(specimen, panel, SEED, REPETITIONS) for specimen in chosen)
    return pd.DataFrame(rows)
