"""`armlab proof real-conditioning`: every recording window by window, one page, two tables and one picture."""

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from armlab.common.settings import suggest_name
from armlab.proof.open.conditioning.answer import choice_table, correlation_table
from armlab.proof.open.conditioning.arm import ConditioningStudy, study_arm
from armlab.proof.open.conditioning.conditioning_figure import SHOWN_CRITERIA, conditioning_image
from armlab.proof.open.conditioning.conditioning_page import (
    CHOICES_NAME,
    PAGE_NAME,
    PICTURE_NAME,
    TABLE_NAME,
    answer_lines,
    conditioning_page,
    table_csv,
)
from armlab.proof.open.real_identification.identify_recording import recipe_named
from armlab.proof.open.real_identification.looks import LOOKS_FILE, Looks
from armlab.recordings.public import open_public_recording

ARMS = ("emps", "staubli-tx40", "unisa-ur10", "unisa-panda", "kuka-kr300")


def study_conditioning(
    results: Path, recordings: Path, only: Sequence[str], progress: Callable[[str], None]
) -> Iterator[str]:
    """Lines with the answer and the files that are written.

    recordings: where recordings are, or will be fetched to. only: names, all arms if none is given. A look at a run
    that validates is logged before it happens. Raises InputError for an unknown name.
    """
    for name in only:
        if name not in ARMS:
            raise InputError(f"unknown arm '{name}': {suggest_name(name, ARMS)}")
    names = [name for name in ARMS if not only or name in only]
    opened = [open_public_recording(name, recordings) for name in names]
    looks, studies = Looks(results / LOOKS_FILE), list[ConditioningStudy]()
    for number, (name, recording) in enumerate(zip(names, opened, strict=True), 1):
        progress(f"windows of {name}, {number} of {len(names)}")
        for run in recording.with_role("validate"):
            looks.note(name, run.name, "conditioning")
        studies.append(study_arm(recipe_named(name), recording))
    progress("permutations of the blocks")
    table, choices = correlation_table(studies), choice_table(studies, list(SHOWN_CRITERIA))
    yield from answer_lines(table, choices)
    texts: dict[str, str | bytes] = {
        PAGE_NAME: conditioning_page(studies, table, choices),
        TABLE_NAME: table_csv(table),
        CHOICES_NAME: table_csv(choices),
        PICTURE_NAME: conditioning_image(studies, table),
    }
    yield from map(str, write_texts(texts, results))
