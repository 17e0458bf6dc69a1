"""Runs the examples of a document in a folder, in their order, as a reader would.

A block of `bash` is run line by line, a block of `python` is run, and a block whose first line is a comment with a
path (`# mine.yaml`) is written to that file. Blocks of `text` show output. `make` lines and shell of other kinds are
refused, except for the installation of a package of the document, whose entry points are registered.
"""

import contextlib
import io
import re
import shlex
import sys
import tomllib
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import click

from armlab.cli.main import main

BLOCK = re.compile(r"^```(bash|python|yaml|toml)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
FILE_LINE = re.compile(r"# ([\w./-]+\.(?:py|yaml|toml))\n")
INSTALL = "python -m pip install --no-deps --no-build-isolation -e "


@dataclass(frozen=True)
class Step:
    """A file to write, a command line or a Python script. path: of the file, or empty."""

    kind: str
    text: str
    path: str = ""


def read_steps(document: Path) -> Iterator[Step]:
    """The steps of a document; a block of YAML or TOML without a path is a sketch, and no step."""
    for language, text in BLOCK.findall(document.read_text(encoding="utf-8")):
        named = FILE_LINE.match(text)
        if named:
            yield Step("file", text, named[1])
        elif language == "bash":
            yield from (Step("command", line.split("  #")[0].strip()) for line in text.splitlines() if line.strip())
        elif language == "python":
            yield Step("script", text)


def run_step(step: Step) -> str:
    """Does a step in the working folder and returns what it prints; RuntimeError where it fails."""
    if step.kind == "file":
        path = Path(step.path)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(step.text, encoding="utf-8")
        return ""
    if step.kind == "command":
        return _run_command(step.text)
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        exec(compile(step.text, "example", "exec"), {"__name__": "__main__"})
    return printed.getvalue()


def _run_command(line: str) -> str:
    if line.startswith(INSTALL):
        _register(Path(line.removeprefix(INSTALL)).absolute())
        return ""
    name, *arguments = shlex.split(line)
    if name != "armlab":
        raise RuntimeError(f"'{line}': only armlab commands are run")
    printed = io.StringIO()
    with contextlib.redirect_stdout(printed):
        try:
            status = main.main(arguments, prog_name="armlab", standalone_mode=False)
        except click.ClickException as error:
            raise RuntimeError(f"{line}: {error.format_message()}") from None
    if status:
        raise RuntimeError(f"{line}: ended with status {status}")
    return printed.getvalue()


def _register(folder: Path) -> None:
    """What an installation leaves: the folder on the path, and metadata with its entry points."""
    project = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    information = folder / f"{project['name'].replace('-', '_')}-{project['version']}.dist-info"
    information.mkdir(exist_ok=True)
    head = f"Metadata-Version: 2.1\nName: {project['name']}\nVersion: {project['version']}\n"
    (information / "METADATA").write_text(head, encoding="utf-8")
    lines = [
        line
        for group, entries in project["entry-points"].items()
        for line in (f"[{group}]", *(f"{name} = {place}" for name, place in entries.items()))
    ]
    (information / "entry_points.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    sys.path.insert(0, str(folder))
