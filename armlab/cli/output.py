"""How a command tells its result: lines or one JSON document on the standard output, progress on standard error.

A command that is decorated with `prints_lines` or `prints_result` returns the lines instead of printing them. Both add
`--quiet`; `prints_result` adds `--json`, too, whose document is what the lines' generator returns at its end.
"""

import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, nullcontext, redirect_stdout
from functools import wraps
from typing import Any

import click

from armlab.cli.progress import Progress
from armlab.common.documents import Document, FailedResultError, ResultLines, json_text

_PROGRESS = "armlab.progress"  # key of the running command's progress in click's context
_SILENT = "armlab.silent"  # key in click's context: whether the command was told to print no lines

_STANDARD_OUTPUT, _STANDARD_ERROR = 1, 2  # file descriptors, which processes of plug-ins inherit
quiet_option = click.option("--quiet", is_flag=True, help="Print no lines and no progress, only errors.")
json_option = click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON document.")


def tell_progress(message: str) -> None:
    """Tell what the running command is doing; nothing under `--quiet` and outside a command."""
    progress = _current_progress()
    if progress is not None:
        progress.tell(message)


def can_ask() -> bool:
    """Whether someone can answer questions: a terminal at both ends, and neither `--quiet` nor `--json`.

    Then progress shows no line each second.
    """
    silent = click.get_current_context().meta.get(_SILENT, False)
    asks = not silent and sys.stdin.isatty() and sys.stdout.isatty()
    progress = _current_progress()
    if asks and progress is not None:
        progress.stop_ticking()  # a line that comes each second would stand over the questions
    return asks


def trial_bar(total: int, done: int) -> Any:
    """A bar over trials with the time left, on the error stream; silent where no one watches."""
    from tqdm import tqdm

    progress = _current_progress()
    if progress is not None:
        progress.stop()
    hidden = True if progress is not None and progress.quiet else None  # None: shown on a terminal alone
    return tqdm(total=total, initial=done, unit="trial", disable=hidden)


def prints_lines(command: Callable[..., Iterable[str]]) -> Callable[..., None]:
    """Print the lines that a command returns; adds --quiet."""

    @wraps(command)
    def run(*, quiet: bool, **options: Any) -> None:
        progress = _start_progress(quiet)
        try:
            for line in command(**options):
                _print_line(line, progress)
        finally:
            progress.stop()

    return quiet_option(run)


def prints_result(command: Callable[..., ResultLines]) -> Callable[..., None]:
    """Print the lines that a command returns, or the document at their end alone; adds --quiet and --json."""

    @wraps(command)
    def run(*, quiet: bool, as_json: bool, **options: Any) -> None:
        progress = _start_progress(quiet)
        click.get_current_context().meta[_SILENT] = quiet or as_json
        try:
            with _prints_to_errors() if as_json else nullcontext():
                document = _print_lines(command(**options), progress, hidden=as_json)
        except FailedResultError as error:
            _print_document(error.document, as_json)
            raise
        finally:
            progress.stop()
        _print_document(document, as_json)

    return json_option(quiet_option(run))


@contextmanager
def _prints_to_errors() -> Iterator[None]:
    """What plug-ins and their processes print meanwhile goes to the error stream: the document stands alone."""
    with redirect_stdout(sys.stderr):
        kept = os.dup(_STANDARD_OUTPUT)
        os.dup2(_STANDARD_ERROR, _STANDARD_OUTPUT)
        try:
            yield
        finally:
            os.dup2(kept, _STANDARD_OUTPUT)
            os.close(kept)


def _print_lines(lines: ResultLines, progress: Progress, hidden: bool) -> Document:
    """The document at the end of the lines."""
    while True:
        try:
            line = next(lines)
        except StopIteration as end:
            document: Document = end.value
            return document
        if not hidden:
            _print_line(line, progress)


def _print_line(line: str, progress: Progress) -> None:
    progress.clear()
    progress.take_line(line)
    if not progress.quiet:
        click.echo(line)


def _print_document(document: Document, as_json: bool) -> None:
    if as_json:
        click.echo(json_text(document), nl=False)


def _start_progress(quiet: bool) -> Progress:
    progress = Progress(click.get_current_context().command_path.partition(" ")[2], quiet)
    progress.start()
    click.get_current_context().meta[_PROGRESS] = progress
    return progress


def _current_progress() -> Progress | None:
    context = click.get_current_context(silent=True)
    return None if context is None else context.meta.get(_PROGRESS)
