"""Types of option values that the commands share: numbers that are finite, and places to write to that have a name."""

import math
from pathlib import Path
from typing import Any

import click


class FiniteNumber(click.FloatRange):
    """A number in a range; `nan` and `inf`, which pass the comparisons of a range, are refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number; a usage error for what is no finite number of the range."""
        number = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


class JobCount(click.types.IntParamType):
    """A number of processes, as joblib counts them: -1 is one a core; zero, which does nothing, is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The number; a usage error for zero."""
        number = super().convert(value, param, ctx)
        if number == 0:
            self.fail("0 processes do nothing; -1 is one a core.", param, ctx)
        return number


class OutputPath(click.Path):
    """A file or folder to write; an empty name, which would be the working folder, is refused."""

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path; a usage error for an empty name."""
        if not str(value):
            self.fail("an empty name; the working folder is '.'", param, ctx)
        return super().convert(value, param, ctx)


tip_option = click.option(
    "--tip", metavar="LINK", help="Link of the robot file where the arm ends; what moves beside it is locked."
)
lock_option = click.option(
    "--lock", multiple=True, metavar="JOINT=VALUE", help="Joint to lock at a position in rad or m."
)


class PagePath(OutputPath):
    """An HTML page to write; a name without the ending .html, which no browser opens as a page, is refused."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        """The path; a usage error for another ending."""
        path = super().convert(value, param, ctx)
        if path.suffix.lower() not in (".html", ".htm"):
            self.fail(f"'{value}' should end with .html, like page.html.", param, ctx)
        return path
