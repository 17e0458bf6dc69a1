"""The page of the Python interface: the public names of `armlab` with their signatures and docstrings."""

import inspect
import re
from typing import Any

import armlab
from armlab.common.arrays import Array
from armlab.common.markdown import markdown_page
from tools.site.pages import Pages

FIRST = """\
`import armlab` gives all names; each is imported when it is first used. Angles are in rad, lengths in m, torques in
N m, times in s."""


def interface_pages() -> Pages:
    """The page of the public names, functions before classes."""
    values = {name: getattr(armlab, name) for name in armlab.__all__ if not name.startswith("__")}
    functions = {name: value for name, value in values.items() if not inspect.isclass(value)}
    classes = {name: value for name, value in values.items() if inspect.isclass(value)}
    parts = [FIRST, "## Functions", *(_entry(name, value) for name, value in functions.items())]
    parts += ["## Classes", *(_class_entry(name, value) for name, value in classes.items())]
    return {"reference/python.md": markdown_page("Python interface", *parts)}


def _entry(name: str, value: Any, level: int = 3) -> str:
    if not callable(value):
        doc = inspect.getdoc(value)
        return f"{'#' * level} {name}\n\n{_docstring(doc)}"
    return f"{'#' * level} {name}\n\n```python\n{_signature(name, value)}\n```\n\n{_docstring(inspect.getdoc(value))}"


def _class_entry(name: str, value: type) -> str:
    parts = [_entry(name, value)]
    for member_name, member in vars(value).items():
        if member_name.startswith("_"):
            continue
        function = inspect.unwrap(getattr(member, "__func__", member))
        if isinstance(member, property):
            parts.append(f"**`{member_name}`**: {_docstring(inspect.getdoc(member))}")
        elif inspect.isfunction(function) and inspect.getdoc(function):
            parts.append(f"**`{_signature(member_name, function)}`**: {_docstring(inspect.getdoc(function))}")
    return "\n\n".join(parts)


def _signature(name: str, value: Any) -> str:
    """The signature with names of types as short as they can be."""
    try:
        text = str(inspect.signature(value))
    except ValueError:
        return f"{name}(...)"
    text = re.sub(r"(\*\*\w+): [^,)]*", r"\1", text.replace(str(Array), "Array"))
    text = re.sub(r"\b(?:[a-z_]\w*\.)+(?=[A-Za-z])", "", text)
    text = re.sub(r"<[^<>]*(?:<lambda>)?[^<>]*>", "...", text)  # a default that has no notation
    return f"{name}{text.replace('(self, ', '(').replace('(self)', '()')}"


def _docstring(text: str | None) -> str:
    """A docstring as Markdown: blocks that are indented are code, nothing else is markup."""
    return re.sub(r"(?<!`)([*<])", r"\\\1", text or "")
