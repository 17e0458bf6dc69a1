"""Tails and quantiles of the usual distributions, by the special functions that scipy.stats is made of.

scipy.stats looks at each of thousands of calls for every kind of argument, which takes longer than the answer.
"""

from scipy.special import chdtrc, fdtrc, ndtri, stdtr, stdtrit


def student_tail(value: float, degrees: float) -> float:
    """Chance that Student's t with these degrees of freedom is larger than a value."""
    return float(stdtr(degrees, -value))


def student_quantile(chance: float, degrees: float) -> float:
    """The value that Student's t with these degrees of freedom is below with a chance."""
    return float(stdtrit(degrees, chance))


def fisher_tail(value: float, numerator: float, denominator: float) -> float:
    """Chance that Fisher's F with these degrees of freedom is larger than a value, which is not negative."""
    return float(fdtrc(numerator, denominator, value))


def chi_square_tail(value: float, degrees: float) -> float:
    """Chance that a chi-square with these degrees of freedom is larger than a value; 1 below zero."""
    return float(chdtrc(degrees, max(value, 0.0)))


def normal_quantile(chance: float) -> float:
    """The value that a standard normal number is below with a chance."""
    return float(ndtri(chance))
