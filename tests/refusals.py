"""What a user is told about a mistake."""

import ast
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import pytest

from armlab.common.errors import InputError


def refusal(act: Callable[..., object], *given: object, **settings: object) -> str:
    """The message of the InputError that an act raises; it has to be one line."""
    with pytest.raises(InputError) as raised:
        act(*given, **settings)
    message = str(raised.value)
    assert "\n" not in message
    return message


def refusing_lines(paths: Iterable[Path]) -> dict[tuple[str, int], str]:
    """Where source files refuse: name of the file and first line of each statement, with its text."""
    found = {}
    for path in paths:
        text = path.read_text(encoding="utf-8")
        for node in ast.walk(ast.parse(text)):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                name = getattr(node.exc.func, "id", "")
                if name in ("InputError", "DataError"):  # other errors become questions, whose sentences are elsewhere
                    found[path.name, node.lineno] = ast.get_source_segment(text, node) or ""
    return found


def lines_passed(error: BaseException | None) -> Iterator[tuple[str, int]]:
    """Name of the file and line of each frame that an error, and those behind it, passed through."""
    while error is not None:
        trace = error.__traceback__
        while trace is not None:
            yield Path(trace.tb_frame.f_code.co_filename).name, trace.tb_lineno
            trace = trace.tb_next
        error = error.__context__
