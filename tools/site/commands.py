"""Pages of the commands, one a command: what it does, its arguments and its options, as the command line has them."""

import inspect
import re
from collections.abc import Iterator
from importlib import import_module

import click

from armlab.cli.main import main
from armlab.common.markdown import markdown_page, markdown_table
from tools.site.pages import Pages, toctree

INTRODUCTION = """\
`armlab --help` lists all commands, `armlab COMMAND --help` shows these pages in the terminal. A command ends with
status 0 when it is done, 2 for input that cannot be used (one line says what, where, and what would be right), 1 when
a check or a trial fails, and 130 after Ctrl-C."""


def command_pages() -> Pages:
    """Path and text of each page: an index, and a page a command; a group of commands has one page."""
    context = click.Context(main, info_name="armlab")
    places: dict[str, list[click.Command]] = {}
    for name in main.list_commands(context):
        command = main.get_command(context, name)
        assert command is not None
        if not command.hidden:
            places.setdefault(_module(command), []).append(command)
    pages: Pages = {}
    parts = [INTRODUCTION]
    names = []
    for module, commands in places.items():
        heading = inspect.getdoc(import_module(module)) or module
        rows = [(f"[`armlab {each.name}`]({each.name}.md)", each.get_short_help_str(limit=200)) for each in commands]
        parts += [
            f"## {_heading(module)}",
            heading.split(":")[0].split("\n")[0],
            markdown_table(("command", "does"), rows),
        ]
        for each in commands:
            names.append(str(each.name))
            pages[f"reference/commands/{each.name}.md"] = _page(each, context)
    pages["reference/commands/index.md"] = markdown_page("Commands", *parts, toctree(names, hidden=True))
    return pages


def _module(command: click.Command) -> str:
    """Where its code stands: of a group, that of its first command."""
    if isinstance(command, click.Group):
        return _module(next(iter(command.commands.values())))
    return inspect.unwrap(command.callback).__module__ if command.callback else main.__module__


def _heading(module: str) -> str:
    words = module.rsplit(".", 1)[-1].replace("_", " ")
    return words[0].upper() + words[1:]


def _page(command: click.Command, parent: click.Context) -> str:
    sections = list(_sections(command, parent, level=1))
    return "\n\n".join(sections) + "\n"


def _sections(command: click.Command, parent: click.Context, level: int) -> Iterator[str]:
    context = click.Context(command, info_name=command.name, parent=parent)
    yield f"{'#' * level} armlab {context.command_path.removeprefix('armlab ')}"
    yield _markdown_help(command.help or "")
    usage = " ".join(command.collect_usage_pieces(context))
    yield f"```text\n{context.command_path} {usage}\n```"
    records = [record for each in command.get_params(context) if (record := each.get_help_record(context))]
    yield markdown_table(("argument or option", "meaning"), [(f"`{names}`", _escape(text)) for names, text in records])
    if isinstance(command, click.Group):
        for each in command.commands.values():
            yield from _sections(each, context, level + 1)


def _markdown_help(text: str) -> str:
    """The help as paragraphs; what click keeps as it is (marked with \\b) as a block."""
    paragraphs = inspect.cleandoc(text).split("\n\n")
    kept = [f"```text\n{each[2:]}\n```" if each.startswith("\b\n") else _escape(each) for each in paragraphs]
    return "\n\n".join(kept)


def _escape(text: str) -> str:
    """Text of the terminal as Markdown: nothing in it is markup but names in backticks."""
    return re.sub(r"([*_<>\[\]])(?=[^`]*(?:`[^`]*`[^`]*)*$)", r"\\\1", text)
