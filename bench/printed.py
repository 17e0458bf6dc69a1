"""The numbers that the paper prints; they stand in `printed.yaml`, each with its place in the paper."""

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from armlab.common.settings import Settings, read_yaml, validate

Fraction = tuple[int, int]
Number = int | float


class PrintedJoint(Settings):
    """A row of Table 1: mm, and angles as fractions of pi."""

    a_mm: Number
    d_mm: Number
    alpha: Fraction
    lower: Fraction
    upper: Fraction


class PrintedRow(Settings):
    """A row of Table 3: condition numbers over 30 runs of 50 particles and 30 iterations, and seconds.

    The paper does not say whether its seconds are of one run or of all thirty.
    """

    minimum: float
    average: float
    standard_deviation: float
    seconds: float


class PrintedFigure2(Settings):
    """Statements of the text about Figure 2; costs and seconds by swarm size."""

    iterations: int
    repetitions: int
    best_cost: dict[int, float]
    seconds: dict[int, float]
    cost_decrease_percent: int
    time_increase_percent: int
    optimal_swarm_size: int


class PrintedTable3(Settings):
    """Table 3 by algorithm."""

    swarm_size: int
    iterations: int
    rows: dict[str, PrintedRow]


class PrintedFigure3(Settings):
    """Statements of the text about Figure 3."""

    mutated_at_iteration: int


class PrintedOptimum(Settings):
    """The published coefficients of the trajectory and its condition number."""

    a: tuple[float, ...]
    b: tuple[float, ...]
    c: float
    condition_number: float


class PrintedCounts(Settings):
    """How many parameters the paper calls identifiable, alone or in sums."""

    parameters: int
    alone: int
    combinations: int
    unidentifiable: int


class PrintedParameter(Settings):
    """A parameter of Table 4: kg, kg mm or kg mm2."""

    ideal: Number
    identified: Number


class PrintedLinks(Settings):
    """Eq. 49-53, link by link: kg, kg mm, and the diagonal of the inertia in kg mm2."""

    masses: tuple[float, ...]
    first_moments: tuple[tuple[float, ...], ...]
    inertias: tuple[tuple[Number, ...], ...]


class PrintedConclusion(Settings):
    """The percentages and the rank of section 6."""

    gain_percent: tuple[int, int]
    time_rank: int
    slower_percent: float
    slower_than: str
    time_reduction_percent: tuple[int, int]


class Printed(Settings):
    """All numbers of the paper that are compared with ours."""

    table1: tuple[PrintedJoint, ...]
    table2: dict[str, dict[str, Number]]
    figure2: PrintedFigure2
    table3: PrintedTable3
    figure3: PrintedFigure3
    optimum: PrintedOptimum
    identifiable: PrintedCounts
    named: tuple[str, ...]
    table4: dict[str, PrintedParameter]
    eq49_53: PrintedLinks
    conclusion: PrintedConclusion


@lru_cache(maxsize=1)
def read_printed() -> Printed:
    """The paper's numbers."""
    path = Path(__file__).with_suffix(".yaml")
    content: Any = read_yaml(path)
    return validate(Printed, content, str(path))


def times_pi(fraction: Fraction) -> float:
    """The angle, rad, of a fraction of pi."""
    return float(np.pi * fraction[0] / fraction[1])


def display_name(label: str) -> str:
    """A label with the algorithm's name, its first word, as the paper writes it; other labels stay as they are."""
    name, space, rest = label.partition(" ")
    return {"mupso": "MuPSO"}.get(name, name.upper() if name in read_printed().table2 else name) + space + rest
