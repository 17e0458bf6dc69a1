"""Sequential quadratic programming with exact derivatives, and the same behind a swarm.

Step k solves the quadratic programme (Nocedal and Wright 2006, eq. 18.11; Kraft 1988, scipy's SLSQP)

    minimise over d   f(x_k) + grad f(x_k)' d + d' B_k d / 2
    such that         g_i(x_k) + grad g_i(x_k)' d >= 0,   lower <= x_k + d <= upper

with f the problem's smooth value, g_i the distances to its limits and B_k the BFGS estimate of the Hessian of the
Lagrangian; a line search on the L1 merit function takes x_k + alpha d.

Around it, what a criterion of singular values needs:
- f is sharpened in stages: each stage starts where the last one ended;
- only limits that are near are handed to the solver; if its answer breaks others, they are added, and it starts again;
- coordinates run from -1 to 1 over the box.

`sqp` starts from the best of the first population; where a descent has ended, it draws as many new points, whose best
is the next start. `spso-sqp` gives the first half of its horizon to SPSO and starts from the best that SPSO found.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np
from annotated_types import Ge, MinLen
from numpy.typing import NDArray
from scipy.optimize import minimize

from algorithms.contract import Box, uniform_points
from algorithms.driver import clip
from algorithms.parameter_types import NotNegative, Positive, Share
from algorithms.peers.peer import GradientPeer, Inquire, Start
from algorithms.spso import SPSO
from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question

Differentiate = Callable[[Array, Question], Derivatives]
_UNUSABLE_VALUE = 1e3  # in place of a value that is not finite: above the logarithm of any condition number


@dataclass(frozen=True)
class SQPParams:
    """powers: sharpness of each stage. steps: of the solver in a stage, at most. cuts: times that a stage is run.

    watch: limits nearer than this share of half of their range are handed to the solver. tightening: by which a limit
    is kept, in the same unit, so that rounding breaks none. tolerance: of the solver, on f.
    """

    powers: Annotated[tuple[Positive, ...], MinLen(1)] = (10.0, 100.0, 1000.0)
    steps: Annotated[int, Ge(1)] = 15
    cuts: Annotated[int, Ge(1)] = 3
    watch: NotNegative = 0.3
    tightening: NotNegative = 1e-9
    tolerance: NotNegative = 1e-10


def descend(
    params: SQPParams, differentiate: Differentiate, box: Box, start: Array, solver: "Solver | None" = None
) -> Iterator[Array]:
    """The point (d,) after each call of the solver, SLSQP or another, from `start` (d,) to a local optimum."""
    point = start
    for power in params.powers:
        watched = np.zeros(0, dtype=np.intp)
        for _ in range(params.cuts):
            stage = Stage(params, differentiate, box, power, watched)
            point = stage.solve(point, solver or run_slsqp)
            yield point
            watched = stage.watched
            if stage.margins(point).min(initial=0.0) >= 0.0:
                break


@dataclass(eq=False)
class Stage:
    """What one call of the solver sees, in coordinates (d,) from -1 to 1 over the box, called shares.

    watched: the limits (k,) that it gets, chosen at its first point.
    """

    params: SQPParams
    differentiate: Differentiate
    box: Box
    power: float
    watched: NDArray[np.intp]
    started: bool = False
    latest: tuple[bytes, Derivatives] | None = None
    seen: dict[bytes, Array] = field(default_factory=dict)

    def solve(self, point: Array, solver: "Solver") -> Array:
        """The solver's answer (d,), within the box."""
        share = np.clip((point - self._middle) / self._half, -1.0, 1.0)
        with np.errstate(all="ignore"):  # a line search may leave where the value is finite
            answer = solver(self, share)
        return self._point(answer if np.all(np.isfinite(answer)) else share)

    def margins(self, point: Array) -> Array:
        """Distances (m,) to all limits at a point (d,)."""
        key = point.tobytes()
        return self.seen[key] if key in self.seen else self._at(point).margins

    @property
    def _middle(self) -> Array:
        return (self.box.lower + self.box.upper) / 2

    @property
    def _half(self) -> Array:
        return (self.box.upper - self.box.lower) / 2

    def _point(self, share: Array) -> Array:
        return np.asarray(np.clip(self._middle + self._half * share, self.box.lower, self.box.upper))

    def _at(self, point: Array) -> Derivatives:
        """The derivatives at a point (d,), asked once; the first answer chooses the watched limits."""
        key = point.tobytes()
        if self.latest is not None and self.latest[0] == key:
            return self.latest[1]
        within = -np.inf if self.started else self.params.watch
        found = self.differentiate(point, Question(self.power, self.watched, within))
        self.watched, self.started, self.latest = found.watched, True, (key, found)
        self.seen[key] = np.nan_to_num(found.margins, nan=-1.0, posinf=np.inf)
        return found

    def objective(self, share: Array) -> tuple[float, Array]:
        """The smooth value and its slope (d,)."""
        found = self._at(self._point(share))
        if not (np.isfinite(found.value) and np.all(np.isfinite(found.slope))):
            return _UNUSABLE_VALUE, np.zeros(len(share))
        return found.value, found.slope * self._half

    def distances(self, share: Array) -> Array:
        """Distances (k,) to the watched limits, negative where one is broken."""
        found = self._at(self._point(share))
        return np.nan_to_num(found.margins[found.watched] - self.params.tightening, nan=-1.0)

    def distance_slopes(self, share: Array) -> Array:
        """Slopes (k, d) of the distances."""
        return np.nan_to_num(self._at(self._point(share)).margin_slopes * self._half)


Solver = Callable[[Stage, Array], Array]
"""Shares (d,) to start from, to the solver's answer (d,)."""


def run_slsqp(stage: Stage, share: Array) -> Array:
    """scipy's SLSQP."""
    answer = minimize(
        stage.objective,
        share,
        jac=True,
        bounds=[(-1.0, 1.0)] * len(share),
        constraints=[{"type": "ineq", "fun": stage.distances, "jac": stage.distance_slopes}],
        method="SLSQP",
        options={"maxiter": stage.params.steps, "ftol": stage.params.tolerance},
    )
    return np.asarray(answer.x)


def descend_again_and_again(
    params: SQPParams, inquire: Inquire, start: Start, first: Array, solver: Solver | None = None
) -> None:
    """Descents from `first` (d,), then from the best of as many new points as the first population has."""
    rng, point = np.random.default_rng(start.seed), first
    while True:  # it is the budget that ends it
        for _ in descend(params, inquire.differentiate, start.box, point, solver):
            pass
        points = uniform_points(len(start.X), start.box, rng)
        point = points[np.argmin(inquire(points))]


class SQP(GradientPeer):
    """Descents one after the other, from the best of each population of random points."""

    name = "sqp"
    Params = SQPParams

    @staticmethod
    def search(params: SQPParams, start: Start, evaluate: Inquire) -> None:
        descend_again_and_again(params, evaluate, start, start.X[np.argmin(start.loss)])


@dataclass(frozen=True)
class SPSOThenSQPParams(SQPParams):
    """swarm_share: of the horizon, for SPSO with the constants of Table 2."""

    swarm_share: Share = 0.5


class SPSOThenSQP(GradientPeer):
    """SPSO for a share of the horizon, then descents, the first one from SPSO's best."""

    name = "spso-sqp"
    Params = SPSOThenSQPParams

    @staticmethod
    def search(params: SPSOThenSQPParams, start: Start, evaluate: Inquire) -> None:
        populations = round(params.swarm_share * start.horizon)
        state = SPSO.init(SPSO.Params(), start.X, start.box, populations, np.random.default_rng(start.seed))
        _, state = SPSO.ask(state)
        state = SPSO.tell(state, start.X, start.loss)
        for _ in range(populations):
            asked, state = SPSO.ask(state)
            points = clip(asked, start.box)
            state = SPSO.tell(state, points, evaluate(points))
        descend_again_and_again(params, evaluate, start, SPSO.incumbent(state)[0])
