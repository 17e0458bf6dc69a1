"""Pages of the commands and nouns of the first screen: what each does, with arguments and options."""

import inspect
import re
from collections.abc import Iterator

import click

from armlab.cli.commands import CommandTable
from armlab.cli.main import main
from armlab.common.markdown import markdown_page, markdown_table
from tools.site.pages import Pages, toctree

INTRODUCTION = """\
`armlab --help` lists all commands, `armlab COMMAND --help` shows these pages in the terminal. A command ends with
status 0 when it is done, 2 for input that cannot be used (one line says what, where, and what would be right), 1 when
a check or a trial fails, and 130 after Ctrl-C."""


def command_pages() -> Pages:
    """Path and text of each page: an index, and a page for each command of the first screen and for each noun."""
    context = click.Context(main, info_name="armlab")
    assert isinstance(main, CommandTable)
    parts = [INTRODUCTION]
    for title, names in main.sections.items():
        parts += [f"## {title}", _table([_command(main, context, name) for name in names])]
    commands = [_command(main, context, name) for name in main.places]
    pages = {f"reference/commands/{each.name}.md": _page(each, context) for each in commands}
    index = markdown_page("Commands", *parts, toctree(list(main.places), hidden=True))
    return pages | {"reference/commands/index.md": index}


def _command(table: CommandTable, context: click.Context, name: str) -> click.Command:
    command = table.get_command(context, name)
    assert command is not None
    return command


def _table(commands: list[click.Command]) -> str:
    """Commands with links to their pages; the commands of a noun stand beside it."""
    rows = []
    for each in commands:
        inside = f" {', '.join(f'`{name}`' for name in each.places)}." if isinstance(each, CommandTable) else ""
        rows.append((f"[`armlab {each.name}`]({each.name}.md)", each.get_short_help_str(limit=200) + inside))
    return markdown_table(("command", "does"), rows)


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
    if isinstance(command, CommandTable):
        for name in command.places:
            yield from _sections(_command(command, context, name), context, level + 1)


def _markdown_help(text: str) -> str:
    """The help as paragraphs; what click keeps as it is (marked with \\b) as a block."""
    paragraphs = inspect.cleandoc(text).split("\n\n")
    kept = [f"```text\n{each[2:]}\n```" if each.startswith("\b\n") else _escape(each) for each in paragraphs]
    return "\n\n".join(kept)


def _escape(text: str) -> str:
    """Text of the terminal as Markdown: nothing in it is markup but names in backticks."""
    return re.sub(r"([*_<>\[\]])(?=[^`]*(?:`[^`]*`[^`]*)*$)", r"\\\1", text)
