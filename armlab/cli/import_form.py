"""The form of `armlab recording import` in a terminal: what was recognised, then each open question with a proposal."""

import shlex
import shutil
import textwrap
from collections.abc import Mapping, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import click

from armlab.cli.output import tell_progress
from armlab.common.errors import InputError
from armlab.recordings.imports.files import describe_plan
from armlab.recordings.imports.plan import ImportPlan, plan_import
from armlab.recordings.imports.questions import Question
from armlab.recordings.imports.sources import read_sources
from bench.errors import StoppedError

MAX_NAME_WIDTH = 18  # letters, those of `reference_position`; the path of a file may be longer
FLAGS = {"units": "--unit"}  # of options whose flag is not their name


def fill_in(files: Sequence[Path], options: Mapping[str, Any]) -> ImportPlan:
    """The plan of an import without open questions: each one is asked until its answer can be right.

    Raises InputError for an option of the command that cannot be right, and StoppedError where the user breaks off.
    """
    read = cache(partial(read_sources, progress=tell_progress))

    def answered(plan: ImportPlan, question: Question, answer: str) -> ImportPlan:
        try:
            return plan_import(files, question.with_answer(plan.options, answer), read)
        except InputError as error:
            raise click.UsageError(str(error)) from None  # what click shows before it asks again

    plan = plan_import(files, options, read)
    if plan.questions:
        _show(plan)
    while plan.questions:
        before, question = plan, plan.questions[0]
        try:
            plan = click.prompt(
                question.text,
                default=question.proposal,
                value_proc=lambda answer, plan=before, question=question: answered(plan, question, answer),
            )
        except click.Abort:
            raise StoppedError("stopped: nothing is written") from None
    return plan


def command_of(files: Sequence[Path], options: Mapping[str, Any]) -> str:
    """The command that gives these options, for a shell."""
    words = ["armlab", "recording", "import", *map(str, files)]
    for name, value in options.items():
        for each in value if isinstance(value, tuple) else (value,):
            if each not in (None, "", False):
                flag = FLAGS.get(name, f"--{name.replace('_', '-')}")
                words += [flag] if each is True else [flag, str(each)]
    return shlex.join(words)


def _show(plan: ImportPlan) -> None:
    """The table of what was recognised, and how to answer."""
    rows, width = describe_plan(plan), shutil.get_terminal_size().columns
    name_width = max((len(name) for name, _ in rows if len(name) <= MAX_NAME_WIDTH), default=MAX_NAME_WIDTH)
    click.echo("Recognised:")
    for name, text in rows:
        start, after = f"  {name.ljust(name_width)}  ", " " * (name_width + 4)
        click.echo(textwrap.fill(text, width, initial_indent=start, subsequent_indent=after))
    click.echo("Still open; Enter takes the proposal in brackets, Ctrl-C stops and writes nothing.")
