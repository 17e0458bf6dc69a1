"""The probability of superiority A12 (Vargha and Delaney 2000) with an interval that holds near 0 and 1, and how often
it holds.

A12 of n ends of a subject and m of a rival is the share of the n m pairs in which the subject is better, ties counting
half: Mann and Whitney's U over n m. Its variance at a true superiority t, for exponential ends, is (Hanley and McNeil
1982; Newcombe 2006, method 5, with the mean sample size in both places)

    V(t) = t (1 - t) (1 + s (1 - t) / (2 - t) + s t / (1 + t)) / (n m),   s = (n + m) / 2 - 1

and the interval holds every t with |A12 - t| <= q V(t)^(1/2). Newcombe's q is that of the normal distribution; with
Student's at s degrees of freedom, which was chosen on simulations like those below, it stays nearer to its level for a
dozen ends of unequal spread. Where all pairs agree it has one end inside. Paired ends (common first populations) vary
less than this, so that the interval is too wide, not too narrow. No package of ours has it: scipy has none,
statsmodels' is Brunner and Munzel's, which ends at 0 and 1.
"""

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtri
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.common.streams import named_generator

LEVEL = 0.95
_JUST_BELOW_ONE = 1.0 - 1e-12


def superiority(subject: Array, rival: Array) -> tuple[float, float, float]:
    """A12 of losses (n,) and (m,), smaller being better, with its 95 % interval; (1/2, 0, 1) without any."""
    if not len(subject) or not len(rival):
        return 0.5, 0.0, 1.0
    won = np.searchsorted(np.sort(rival), subject, side="right") + np.searchsorted(np.sort(rival), subject, side="left")
    half_wins = 2 * len(subject) * len(rival) - int(won.sum())
    return half_wins / (2 * len(subject) * len(rival)), *_interval(half_wins, len(subject), len(rival))


@lru_cache(maxsize=65536)
def _interval(half_wins: int, n: int, m: int) -> tuple[float, float]:
    """The interval of half_wins / (2 n m), each bound from the side where it is the lower one."""
    share = half_wins / (2 * n * m)
    return _lower_bound(share, n, m), 1.0 - _lower_bound(1.0 - share, n, m)


def _lower_bound(share: float, n: int, m: int) -> float:
    """The least t below the share with share - t = q V(t)^(1/2)."""
    if share <= 0.0:
        return 0.0
    s = max((n + m) / 2 - 1, 1.0)
    q = float(student.ppf((1 + LEVEL) / 2, s))

    def excess(t: float) -> float:
        variance = t * (1 - t) * (1 + s * (1 - t) / (2 - t) + s * t / (1 + t)) / (n * m)
        return float(share - t - q * np.sqrt(variance))

    return float(brentq(excess, 0.0, min(share, _JUST_BELOW_ONE)))


COVERAGE_EFFECTS = (0.5, 0.56, 0.64, 0.71, 0.8, 0.9, 0.95, 0.99)
COVERAGE_REPETITIONS = (12, 15, 30)
COVERAGE_SIMULATIONS = 4000


def superiority_coverage(simulations: int = COVERAGE_SIMULATIONS) -> dict[str, dict[str, dict[str, float]]]:
    """By distribution of the ends, repetitions and true A12: the share of simulated intervals that hold the truth."""
    return {
        name: {
            str(n): {f"{effect:g}": _coverage(name, n, effect, simulations) for effect in COVERAGE_EFFECTS}
            for n in COVERAGE_REPETITIONS
        }
        for name in _DISTRIBUTIONS
    }


def describe_coverage(found: dict[str, dict[str, dict[str, float]]]) -> list[str]:
    """The least coverage of each distribution, in words."""
    least = {name: min(min(shares.values()) for shares in by.values()) for name, by in found.items()}
    return [f"A12, {name}: at least {100 * share:.1f} % of the intervals" for name, share in least.items()]


def _coverage(name: str, n: int, effect: float, simulations: int) -> float:
    rng = named_generator("coverage of A12", name, n, str(effect))
    subjects, rivals = _DISTRIBUTIONS[name](rng, (simulations, n), effect)
    found = (superiority(subject, rival) for subject, rival in zip(subjects, rivals, strict=True))
    return float(np.mean([low <= effect <= high for _, low, high in found]))


_Draw = Callable[[np.random.Generator, tuple[int, int], float], tuple[Array, Array]]


def _draw_normal(spread: float, correlation: float = 0.0) -> _Draw:
    """Normal ends of the subject, and of a rival with so many times its spread, repetition by repetition correlated."""

    def draw(rng: np.random.Generator, shape: tuple[int, int], effect: float) -> tuple[Array, Array]:
        subject, other = rng.standard_normal((2, *shape))
        rival = spread * (correlation * subject + np.sqrt(1 - correlation**2) * other)
        return subject, np.asarray(rival + ndtri(effect) * np.sqrt(1 + spread**2))

    return draw


def _draw_exponential(rng: np.random.Generator, shape: tuple[int, int], effect: float) -> tuple[Array, Array]:
    subject, rival = rng.exponential(size=(2, *shape))
    return subject, rival * effect / (1 - effect)


def _draw_gumbel(rng: np.random.Generator, shape: tuple[int, int], effect: float) -> tuple[Array, Array]:
    """Skewed to the right, as the logarithm of heavy-tailed ends."""
    subject, rival = rng.gumbel(size=(2, *shape))
    return subject, rival + np.log(effect / (1 - effect))


_DISTRIBUTIONS: dict[str, _Draw] = {
    "normal": _draw_normal(1.0),
    "normal, three times the spread": _draw_normal(3.0),
    "normal, pairs correlated by 0.5": _draw_normal(1.0, 0.5),
    "exponential": _draw_exponential,
    "skewed (Gumbel)": _draw_gumbel,
}
