"""How many numbers somebody had to choose: tuning numbers, those that decide about a name, and named constants."""

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.common.tuning import BY_EYE
from armlab.diagnosis.tuning import Tuning, tuning_numbers

DIAGNOSIS = Path(__file__).parent
READING = DIAGNOSIS.parent / "recordings" / "reading"
DECIDING = tuple(DIAGNOSIS / "torque" / each for each in ("evidence", "names"))  # where names are tested and weighed


@dataclass(frozen=True)
class TuningCounts:
    """How many there are of each kind.

    numbers: tuning numbers. deciding: see `deciding_numbers`. by_eye: those whose source is that somebody chose them by
    eye. constants: see `count_constants`.
    """

    numbers: int
    deciding: int
    by_eye: int
    constants: int


def count_tuning() -> TuningCounts:
    """Of the diagnosis and of the reading."""
    numbers = list(tuning_numbers(Tuning()))
    return TuningCounts(
        len(numbers),
        len(deciding_numbers()),
        sum(each.source == BY_EYE for each in numbers),
        sum(count_constants(tree) for folder in (DIAGNOSIS, READING) for tree in _trees(folder)),
    )


def deciding_numbers() -> list[str]:
    """The tuning numbers that the code of `DECIDING` reads."""
    read = {name for folder in DECIDING for tree in _trees(folder) for name in _attributes(tree)}
    return [each.name for each in tuning_numbers(Tuning()) if read.issuperset(each.name.split("."))]


def count_constants(tree: ast.Module) -> int:
    """Numbers that a module gives a name of its own, as in `LEAST = 0.02` and `LEAST, MOST = 0.02, 30`."""
    values = (each.value for each in tree.body if isinstance(each, ast.Assign | ast.AnnAssign))
    parts = (value.elts if isinstance(value, ast.Tuple) else [value] for value in values)
    return sum(_is_number(each) for part in parts for each in part)


def _is_number(value: ast.expr | None) -> bool:
    if isinstance(value, ast.UnaryOp):
        value = value.operand
    return isinstance(value, ast.Constant) and type(value.value) in (int, float)


def _attributes(tree: ast.Module) -> Iterator[str]:
    return (each.attr for each in ast.walk(tree) if isinstance(each, ast.Attribute))


def _trees(folder: Path) -> Iterator[ast.Module]:
    files = (each for each in sorted(folder.rglob("*.py")) if not each.name.endswith("tuning.py"))
    return (ast.parse(each.read_text(encoding="utf-8")) for each in files)
