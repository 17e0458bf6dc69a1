"""Options of commands that write motions: what a motion keeps off, where it starts, and how far it goes."""

import math
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any

import click

from armlab.cli.options import FiniteNumber

_OPTIONS = (
    click.option(
        "--floor", type=FiniteNumber(min=-100, max=100), metavar="Z", help="Height of the floor in the base frame, m."
    ),
    click.option(
        "--keep-out", multiple=True, metavar="X1,Y1,Z1,X2,Y2,Z2", help="A box to keep off, m: two corners. Repeatable."
    ),
    click.option("--near", metavar="Q1,Q2,...", help="The pose near which the motion starts and ends, rad or m."),
    click.option(
        "--range", "span", metavar="LOW:HIGH,...", help="Of each joint, rad or m; or robot [default: as recorded]."
    ),
    click.option("--clearance", type=FiniteNumber(min=0), help="Distance to keep from all of it, m [default: 0.02]."),
    click.option("--radius", type=FiniteNumber(min=1e-4), help="Of capsules for an arm without geometry, m."),
    click.option("--safety", "file", type=click.Path(path_type=Path), help="YAML with these as keys: floor, ..."),
)


def safety_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Adds the options; the command gets them as `safety`, checked settings."""

    @wraps(command)
    def run(
        *,
        floor: float | None,
        keep_out: tuple[str, ...],
        near: str | None,
        span: str | None,
        clearance: float | None,
        radius: float | None,
        file: Path | None,
        **others: Any,
    ) -> Any:
        given = {
            "floor": floor,
            "keep_out": [_parse_box(each) for each in keep_out] or None,
            "near": None if near is None else _parse_numbers("--near", near),
            "range": None if span is None else _parse_range(span),
            "clearance": clearance,
            "radius": radius,
        }
        return command(
            safety=_settings(file, {key: value for key, value in given.items() if value is not None}), **others
        )

    for option in reversed(_OPTIONS):
        run = option(run)
    return run


def _settings(file: Path | None, given: dict[str, Any]) -> Any:
    """Settings of the file, replaced by what is given on the command line."""
    from armlab.common.settings import read_yaml, validate
    from problem.safe_motion import SafetySettings

    from_file = SafetySettings() if file is None else validate(SafetySettings, read_yaml(file), str(file))
    return validate(SafetySettings, from_file.model_dump(exclude_unset=True) | given, "the safety options")


def _parse_box(text: str) -> list[list[float]]:
    from armlab.common.errors import InputError

    numbers = _parse_numbers("--keep-out", text)
    if len(numbers) != 6:
        raise InputError(f"--keep-out {text}: should be six numbers, X1,Y1,Z1,X2,Y2,Z2, has {len(numbers)}")
    return [numbers[:3], numbers[3:]]


def _parse_range(text: str) -> Any:
    from armlab.common.errors import InputError

    if text == "robot":
        return text
    ends = [_parse_numbers("--range", part.replace(":", ",")) for part in text.split(",")]
    if any(len(each) != 2 for each in ends):
        raise InputError(f"--range {text}: should be robot or one LOW:HIGH a joint, like -1:1,0:0.5")
    return ends


def _parse_numbers(option: str, text: str) -> list[float]:
    """Numbers with commas; InputError, in one line, for what is no finite number."""
    from armlab.common.errors import InputError

    try:
        numbers = [float(each) for each in text.split(",")]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"{option} {text}: should be finite numbers with commas, like 0.1,-1.57,0")
    return numbers
