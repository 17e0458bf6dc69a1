"""What the paired test can see at all: its power after Holm's correction, by simulation.

The model: ends of both algorithms are normal (in log10 or any other scale, since ranks do not care) with equal
spread, so that a chance of superiority A (A12) means paired differences of mean ndtri(A) at a spread of one. That
pairs are not correlated is the pessimistic case. Holm's correction tests the smallest of m p-values at level / m and
the largest at level: the power for one of them lies between the two.
"""

from dataclasses import dataclass
from functools import lru_cache

from scipy.optimize import bisect
from scipy.special import ndtri
from scipy.stats import wilcoxon

from algorithms.contract import Array
from bench.seeds import named_generator

SIMULATIONS = 4000
_NUMBERS = 1_000_000  # drawn at most, so that thousands of repetitions are simulated less often
EFFECTS = (0.56, 0.64, 0.71)  # small, medium, large (Vargha and Delaney 2000)


@dataclass(frozen=True)
class Power:
    """Chance that a true superiority is seen: as the only comparison, and as the first of Holm's steps."""

    superiority: float
    alone: float
    first_step: float


def powers(repetitions: int, comparisons: int, level: float = 0.05) -> list[Power]:
    """The power at that number of repetitions for small, medium and large effects."""
    return [
        Power(
            effect,
            signed_rank_power(repetitions, effect, level),
            signed_rank_power(repetitions, effect, level / comparisons),
        )
        for effect in EFFECTS
    ]


def signed_rank_power(repetitions: int, superiority: float, level: float) -> float:
    """Chance that Wilcoxon's two-sided signed-rank test rejects at that level."""
    return float((_p_values(repetitions, superiority) <= level).mean())


def smallest_seen(repetitions: int, level: float, power: float = 0.8) -> float | None:
    """The superiority that is seen with that power; None if not even a certain win is, with so few repetitions."""
    most = 0.9999
    if signed_rank_power(repetitions, most, level) < power:
        return None
    return float(bisect(lambda a: signed_rank_power(repetitions, a, level) - power, 0.5, most, xtol=1e-3))


@lru_cache(maxsize=128)
def _p_values(repetitions: int, superiority: float) -> Array:
    """P-values for one true effect, one a simulation; the same chance for every effect, so that power grows with it."""
    simulations = max(min(SIMULATIONS, _NUMBERS // repetitions), 100)
    noise = named_generator("power", repetitions).standard_normal((simulations, repetitions))
    p: Array = wilcoxon(noise + ndtri(superiority), axis=1).pvalue
    return p
