"""The facts as one table."""

from collections.abc import Sequence

from bench.properties.facts import Facts

HEADINGS = (
    "algorithm",
    "moved",
    "scaled",
    "noise p, clip",
    "noise p, reflect",
    "on bounds, clip",
    "on bounds, reflect",
    "us an evaluation",
    "in words",
)
READING = """\
50 points, 30 iterations, default parameters. "Moved", "scaled": box, first population and objective are moved by five
units, or made 16 times larger; the figure is by how much the path leaves its own, in widths of the box: 0 up to
rounding where nothing depends on it. "Noise": the objective is chance alone; p of the Kolmogorov-Smirnov test that the
best points of 40 runs are uniform in the box, and the share of their coordinates on a bound, with points outside
clipped to the box or reflected. Microseconds: median time an evaluation of the sphere in 15 dimensions, measured on
this machine."""


def rows(facts: Sequence[Facts]) -> list[list[str]]:
    """Cells of the table, one row an algorithm."""
    return [
        [
            fact.algorithm,
            _deviation(fact.translation),
            _deviation(fact.scale),
            f"{fact.noise_p_value_clip:.2g}",
            f"{fact.noise_p_value_reflect:.2g}",
            f"{fact.on_bounds_clip:.0%}",
            f"{fact.on_bounds_reflect:.0%}",
            f"{fact.overhead:.1f}",
            fact.verdict,
        ]
        for fact in facts
    ]


def _deviation(share: float) -> str:
    return "0" if share < 1e-9 else f"{share:.2g}"
