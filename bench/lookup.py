"""Algorithms by the name that a user gave."""

from algorithms.contract import AnyAlgorithm
from algorithms.registry import BrokenAlgorithmError, UnknownAlgorithmError, load
from problem.errors import InputError


def find_algorithm(name: str, where: str) -> AnyAlgorithm:
    """The algorithm of that name; raises InputError, in one line, if there is none or it cannot be used."""
    try:
        return load(name)
    except (UnknownAlgorithmError, BrokenAlgorithmError) as error:
        raise InputError(f"{where}: {error}") from None
