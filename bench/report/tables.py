"""The tables of the page, as HTML."""

from collections.abc import Iterable, Sequence
from html import escape

import numpy as np

from bench.report.analysis import Cell
from bench.statistics.paired import Duel
from bench.statistics.power import Power, smallest_seen

_SHARES = (0.25, 0.5, 0.75)  # of the way from easy to hard


def table(headings: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """An HTML table in a frame that scrolls sideways; the first cell of a row is its heading."""
    head = "".join(f'<th scope="col">{escape(heading)}</th>' for heading in headings)
    body = "".join(_row(row) for row in rows)
    parts = f"<thead><tr>{head}</tr></thead><tbody>{body}</tbody>"
    return f'<div class="wide" tabindex="0"><table>{parts}</table></div>'


def ends_table(cell: Cell) -> str:
    """Medians with intervals, quartiles, feasible share, area and expected running times on one problem."""
    places = [round(share * (len(cell.targets) - 1)) for share in _SHARES] if len(cell.targets) else []
    headings = ["algorithm", "median (95 %)", "quartiles", "minimum", "feasible", "area"]
    headings += [f"ERT to {cell.targets[place]:.3g}" for place in places]
    return table(headings, [_ends(cell, name, places) for name in cell.algorithms])


def _ends(cell: Cell, name: str, places: Sequence[int]) -> list[str]:
    summary, progress = cell.summary(name), cell.progress[name]
    low, high = cell.median_interval(name)
    return [
        name,
        f"{number(summary.median)} ({number(low)} – {number(high)})",
        f"{number(summary.lower_quartile)} – {number(summary.upper_quartile)}",
        number(summary.minimum),
        f"{summary.feasible_share:.0%}",
        "–" if np.isnan(progress.area) else f"{progress.area:.2f}",
        *(number(progress.expected[place]) for place in places),
    ]


def duels_table(cell: Cell) -> str:
    """The algorithm of the least median against all others."""
    best = min(cell.algorithms, key=lambda name: float(np.median(cell.losses[name])))
    fought = [_seen_from(best, duel) for duel in cell.all_duels if best in (duel.subject, duel.rival)]
    rows = [[duel.rival, _effect(duel), f"{duel.p:.2g}", _word(duel)] for duel in fought]
    return table([f"{best} against", "A12 (95 %)", "p (Holm)", f"{best} is"], rows)


def _seen_from(subject: str, duel: Duel) -> Duel:
    """The same duel with the subject first."""
    if duel.subject == subject:
        return duel
    return Duel(subject, duel.subject, 1 - duel.superiority, 1 - duel.high, 1 - duel.low, duel.p)


def _effect(duel: Duel) -> str:
    return f"{duel.superiority:.2f} ({duel.low:.2f} – {duel.high:.2f})"


def _word(duel: Duel) -> str:
    winner = duel.winner()
    return "not told apart" if winner is None else "better" if winner == duel.subject else "worse"


def tally_table(cells: Sequence[Cell], algorithms: Sequence[str]) -> str:
    """On how many problems an algorithm (row) is better and worse than another (column)."""
    won: dict[tuple[str, str], int] = {}
    for duel in (duel for cell in cells for duel in cell.all_duels):
        winner = duel.winner()
        if winner is not None:
            loser = duel.rival if winner == duel.subject else duel.subject
            won[winner, loser] = won.get((winner, loser), 0) + 1
    rows = [[name, *(_score(won, name, other) for other in algorithms)] for name in algorithms]
    return table(["better – worse", *algorithms], rows)


def _score(won: dict[tuple[str, str], int], name: str, other: str) -> str:
    return "" if name == other else f"{won.get((name, other), 0)} – {won.get((other, name), 0)}"


def power_table(powers: Sequence[Power], repetitions: int, comparisons: int) -> str:
    """What the test can see on one problem."""
    names = ("small", "medium", "large")
    rows = [
        [f"{name}, A12 = {power.superiority:.2f}", f"{power.alone:.0%}", f"{power.first_step:.0%}"]
        for name, power in zip(names, powers, strict=True)
    ]
    seen = [smallest_seen(repetitions, 0.05 / count) for count in (1, comparisons)]
    rows.append(["A12 seen with 80 %", *("none" if effect is None else f"{effect:.2f}" for effect in seen)])
    return table(["true effect", "one comparison", f"first of {comparisons} (Holm)"], rows)


def number(value: float) -> str:
    """Three digits; infinite and unknown as signs."""
    if np.isnan(value):
        return "–"
    if np.isinf(value):
        return "∞"
    return f"{value:.0f}" if 1000 <= value < 1e6 else f"{value:.3g}"


def _row(cells: Sequence[str]) -> str:
    first, *rest = (escape(cell) for cell in cells)
    return f'<tr><th scope="row">{first}</th>{"".join(f"<td>{cell}</td>" for cell in rest)}</tr>'
