"""Ipopt, the interior-point method of Wächter and Biegler 2006, as CasADi brings it.

Form: primal-dual barrier with a filter line search; here with a limited-memory estimate of the Hessian and the adaptive
barrier. It stands where SLSQP stands in `sqp`: the same stages, limits, starts and restarts, so that only the solver
differs. Each trial point of its line search is asked with derivatives, like SLSQP's.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import casadi
import numpy as np

from algorithms.peers.peer import GradientPeer, Inquire, Start
from algorithms.sqp import SQPParams, Stage, descend_again_and_again
from armlab.common.arrays import Array

_QUIET = {"print_level": 0, "sb": "yes"}


@dataclass(frozen=True)
class IpoptParams(SQPParams):
    """steps: Ipopt's iterations in a stage. first_barrier: its `mu_init`, small since each stage starts near."""

    first_barrier: float = 1e-2


class Ipopt(GradientPeer):
    """`sqp` with Ipopt in the place of SLSQP."""

    name = "ipopt"
    Params = IpoptParams

    @staticmethod
    def search(params: IpoptParams, start: Start, evaluate: Inquire) -> None:
        descend_again_and_again(params, evaluate, start, start.X[np.argmin(start.loss)], _run_ipopt)


def _run_ipopt(stage: Stage, share: Array) -> Array:
    rows = len(stage.distances(share))
    functions = _Functions(stage, len(share), rows)
    x = casadi.MX.sym("x", len(share))
    value, distances = functions(x)
    params = stage.params
    options = {
        "print_time": False,
        "show_eval_warnings": False,
        "ipopt": _QUIET
        | {
            "max_iter": params.steps,
            "tol": params.tolerance,
            "hessian_approximation": "limited-memory",
            "mu_init": params.first_barrier if isinstance(params, IpoptParams) else IpoptParams().first_barrier,
        },
    }
    solver = casadi.nlpsol("descent", "ipopt", {"x": x, "f": value, "g": distances}, options)
    answer = solver(x0=share, lbx=-1.0, ubx=1.0, lbg=0.0, ubg=np.inf)
    functions.raise_error()
    return np.asarray(answer["x"]).ravel()


class _Functions(casadi.Callback):  # type: ignore[misc]
    """The value and the watched distances of a stage, with their Jacobians, as CasADi calls them.

    What is raised in a call would be printed by CasADi and end as a failed evaluation. So it is kept, all further calls
    answer NaN, which ends the solver, and it is raised then.
    """

    def __init__(self, stage: Stage, dimension: int, rows: int) -> None:
        casadi.Callback.__init__(self)
        self.stage, self.dimension, self.rows = stage, dimension, rows
        self.error: BaseException | None = None
        self.jacobian_callback: _Jacobians | None = None
        self.construct("functions", {})

    def get_n_in(self) -> int:
        return 1

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> Any:
        return casadi.Sparsity.dense(self.dimension, 1)

    def get_sparsity_out(self, index: int) -> Any:
        return casadi.Sparsity.dense((1, self.rows)[index], 1)

    def eval(self, arguments: Any) -> Any:
        return self.answer(arguments, lambda share: [self.stage.objective(share)[0], self.stage.distances(share)], 1)

    def has_jacobian(self) -> bool:
        return True

    def get_jacobian(self, name: str, inputs: Any, outputs: Any, options: Any) -> Any:
        self.jacobian_callback = _Jacobians(self, name, options)
        return self.jacobian_callback

    def answer(self, arguments: Any, compute: Callable[[Array], list[Any]], width: int) -> list[Any]:
        """Both outputs, (1, width) and (rows, width), at the shares that are the first argument."""
        if self.error is None:
            try:
                return compute(np.asarray(arguments[0]).ravel())
            except BaseException as error:  # the end of the conversation too, which is no Exception
                self.error = error
        return [np.full((1, width), np.nan), np.full((self.rows, width), np.nan)]

    def raise_error(self) -> None:
        """Raise what was raised in a call."""
        if self.error is not None:
            raise self.error


class _Jacobians(casadi.Callback):  # type: ignore[misc]
    """The slopes of both outputs of `_Functions`."""

    def __init__(self, of: _Functions, name: str, options: Any) -> None:
        casadi.Callback.__init__(self)
        self.of = of
        self.construct(name, options)

    def get_n_in(self) -> int:
        return 3  # the shares, and both outputs, which are not used

    def get_n_out(self) -> int:
        return 2

    def get_sparsity_in(self, index: int) -> Any:
        return casadi.Sparsity.dense((self.of.dimension, 1, self.of.rows)[index], 1)

    def get_sparsity_out(self, index: int) -> Any:
        return casadi.Sparsity.dense((1, self.of.rows)[index], self.of.dimension)

    def eval(self, arguments: Any) -> Any:
        stage = self.of.stage
        return self.of.answer(
            arguments, lambda share: [stage.objective(share)[1][None], stage.distance_slopes(share)], self.of.dimension
        )
