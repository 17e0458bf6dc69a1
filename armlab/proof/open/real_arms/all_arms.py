"""What `armlab proof real` does: every public recording by one procedure, one page, one table and one picture."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.report.palette import svg_text
from armlab.common.settings import suggest_name
from armlab.proof.open.peers.side_by_side import compare_peers, write_peers
from armlab.proof.open.real_arms.arms_figure import PICTURE_NAME, draw_studies
from armlab.proof.open.real_arms.arms_page import PAGE_NAME, TABLE_NAME, lines_csv, studies_markdown
from armlab.proof.open.real_arms.checks import check_arm
from armlab.proof.open.real_arms.one_arm import ModelLine, Progress, study_arm
from armlab.proof.open.real_identification.identify_recording import RECIPES, Recipe
from armlab.proof.open.real_identification.looks import LOOKS_FILE, Looks
from armlab.recordings.public import open_public_recording


def prove_on_public_arms(
    results: Path,
    recordings: Path,
    only: Sequence[str] = (),
    peers: Path | None = None,
    progress: Progress = lambda message: None,
) -> Iterator[str]:
    """Lines that tell what was found and written; page, table and picture hold the recordings of this call.

    recordings: where recordings are, or will be fetched to. peers: an interpreter with figaroh and mujoco.sysid, which
    then take part. Raises InputError for an unknown name.
    """
    recipes = chosen_recipes(only)
    opened = [(each, open_public_recording(each.name, recordings)) for each in recipes]
    looks, studies, checks = Looks(results / LOOKS_FILE), [], []
    for number, (recipe, recording) in enumerate(opened, 1):
        study = study_arm(recipe, recording, looks, _numbered(progress, number, len(opened)))
        studies.append(study)
        yield from (line_in_words(line) for line in study.lines)
        progress(f"{recipe.name}: checks")
        checks += list(check_arm(study))
    texts = {
        PAGE_NAME: studies_markdown(studies, checks),
        TABLE_NAME: lines_csv(studies),
        PICTURE_NAME: svg_text(draw_studies(studies), "arms"),
    }
    yield from (str(path) for path in write_texts(texts, results))
    if peers is not None:
        folder = recordings / ".peers"
        compared = [row for each in studies for row in compare_peers(each.identified, peers, folder / each.name, looks)]
        yield str(write_peers(compared, results))


def chosen_recipes(only: Sequence[str]) -> tuple[Recipe, ...]:
    """The recipes of these recordings, of all if none is named; InputError for an unknown name."""
    names = [recipe.name for recipe in RECIPES]
    for name in only:
        if name not in names:
            raise InputError(f"unknown recording '{name}': {suggest_name(name, names)}")
    return tuple(each for each in RECIPES if not only or each.name in only)


def line_in_words(line: ModelLine) -> str:
    """A line of the table for the terminal."""
    shown = ("rigid_refitted", "plain_friction", "identify", "named", "diagnose")
    errors = ", ".join(f"{name} {line.errors[name].filtered:.1f}" for name in shown if name in line.errors)
    return f"{line.arm}, {line.baseline}, {line.run}: {errors} % of filtered torque; time {line.time_ratio:.2f}"


def _numbered(progress: Progress, number: int, count: int) -> Progress:
    return lambda message: progress(f"{number} of {count}: {message}")
