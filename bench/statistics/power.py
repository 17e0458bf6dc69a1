"""The power of the paired test after Holm's correction, by simulation.

Model: the ends of both algorithms are normal with equal spread, in log10 or any other scale, since ranks do not depend
on the scale. A superiority A (A12) then means paired differences of mean ndtri(A) at a spread of one. Pairs are taken
as uncorrelated, which is the pessimistic case. Holm's correction tests the smallest of m p-values at level / m and the
largest at level: the power for one of them lies between the two.
"""

from dataclasses import dataclass
from functools import lru_cache

from scipy.optimize import bisect
from scipy.special import ndtri
from scipy.stats import wilcoxon

from armlab.common.arrays import Array
from armlab.common.streams import named_generator

POWER_SIMULATIONS = 4000
_MAX_RANDOM_NUMBERS = 1_000_000  # drawn at most, so that thousands of repetitions are simulated less often
EFFECT_SIZES = (0.56, 0.64, 0.71)  # small, medium, large (Vargha and Delaney 2000)


@dataclass(frozen=True)
class Power:
    """Probability that a true superiority is detected: as the only comparison, and as the first of Holm's steps."""

    superiority: float
    alone: float
    first_step: float


def powers(repetitions: int, comparisons: int, level: float = 0.05) -> list[Power]:
    """The power with that number of repetitions for small, medium and large effects."""
    return [
        Power(
            effect,
            signed_rank_power(repetitions, effect, level),
            signed_rank_power(repetitions, effect, level / comparisons),
        )
        for effect in EFFECT_SIZES
    ]


def signed_rank_power(repetitions: int, superiority: float, level: float) -> float:
    """Probability that Wilcoxon's two-sided signed-rank test rejects at that level."""
    return float((_simulated_p_values(repetitions, superiority) <= level).mean())


def smallest_detectable_effect(repetitions: int, level: float, power: float = 0.8) -> float | None:
    """The smallest superiority that is detected with that power; None if the repetitions are too few for any."""
    most = 0.9999
    if signed_rank_power(repetitions, most, level) < power:
        return None
    return float(bisect(lambda a: signed_rank_power(repetitions, a, level) - power, 0.5, most, xtol=1e-3))


@lru_cache(maxsize=128)
def _simulated_p_values(repetitions: int, superiority: float) -> Array:
    """P-values for one true effect, one a simulation; all effects use the same random numbers, so power grows with the
    effect.
    """
    simulations = max(min(POWER_SIMULATIONS, _MAX_RANDOM_NUMBERS // repetitions), 100)
    noise = named_generator("power", repetitions).standard_normal((simulations, repetitions))
    p: Array = wilcoxon(noise + ndtri(superiority), axis=1).pvalue
    return p


def power_text(repetitions: int, comparisons: int) -> str:
    """The probabilities to detect true effects with that many paired repetitions, as a sentence."""
    return f"Power with {repetitions} repetitions and Holm over {comparisons}: " + ", ".join(
        _effect_text(power) for power in powers(repetitions, comparisons)
    )


def _effect_text(power: Power) -> str:
    return f"a true A12 of {power.superiority:g} is seen with a chance of {power.first_step:.2f} to {power.alone:.2f}"
