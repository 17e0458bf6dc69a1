"""`armlab bench draw`: the figures that fit a result set."""

from collections.abc import Sequence
from pathlib import Path

from armlab.common.files import write_whole
from bench.comparison_figures import draw_budgets, draw_ends, draw_ranking
from bench.result_sets.formats import make_folder, read_results
from bench.result_sets.result_set import ResultSet
from bench.studies.best_known.records import known_values
from bench.value_names import value_name
from problem.registry import ProblemSettings, parse_problem

MAX_PANELS = 3  # problems whose ends are drawn side by side


def draw_results(where: Path, store: Path, records: Path, folder: Path, formats: Sequence[str]) -> list[Path]:
    """Draw a result set into a folder; returns the files.

    NAME_ends: every end, for up to three problems of one swarm size and budget. NAME_ranking: ranks over the problems,
    or over the repetitions of a single one. NAME_budgets: medians against the budget, where there are several. records:
    the best known trajectories. formats: png, svg, pdf. Raises InputError, in one line, if there are no results.
    """
    results = read_results(where, store)
    make_folder(folder)
    frame = results.trials
    several = frame["budget"].nunique() > 1
    figures = {"ranking": draw_ranking(frame, formats)}
    if frame["problem"].nunique() <= MAX_PANELS and frame["swarm_size"].nunique() == 1:
        problems = _parse_problems(results)
        known = known_values(problems, records)
        names = {label: value_name(problem) for label, problem in problems.items()}
        kind, draw = ("budgets", draw_budgets) if several else ("ends", draw_ends)
        figures[kind] = draw(frame, known, formats, names)
    paths = []
    for name, images in figures.items():
        for suffix, image in images.items():
            path = folder / f"{results.name}_{name}.{suffix}"
            write_whole(path, image)
            paths.append(path)
    return paths


def _parse_problems(results: ResultSet) -> dict[str, ProblemSettings]:
    return {
        label: parse_problem(settings, f"problem '{label}' of {results.name}")
        for label, settings in results.problems.items()
    }
