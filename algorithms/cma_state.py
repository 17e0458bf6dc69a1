"""A state around an optimiser of the package `cmaes` that can be pickled and resumed."""

from typing import Any

from cmaes import CMA


class HoldsOptimiser:
    """Base of a state dataclass with a field `optimiser`, which holds the random generator."""

    def __getstate__(self) -> dict[str, Any]:
        # pickled by itself, the optimiser would lose its random generator and half of its covariance matrix
        state = self.__dict__
        return {**state, "optimiser": dict(state["optimiser"].__dict__)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        optimiser = CMA.__new__(CMA)
        optimiser.__dict__.update(state["optimiser"])
        self.__dict__.update({**state, "optimiser": optimiser})
