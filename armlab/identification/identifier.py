"""Identification in the manners of scikit-learn: settings in the constructor, then `fit`, `predict`, `score`."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import block_diag

from armlab.common.arrays import Array
from armlab.effects.contract import Candidate
from armlab.effects.scene import scene_of
from armlab.identification.components import usual_components
from armlab.identification.covariance import uncertainty
from armlab.identification.cross_validation import held_out_errors
from armlab.identification.estimators.least_squares import (
    EXCITED_TOLERANCE,
    RANK_TOLERANCE,
    BayesianLeastSquares,
    Estimate,
    Estimator,
    OrdinaryLeastSquares,
    RobustLeastSquares,
    WeightedLeastSquares,
    column_lengths,
)
from armlab.identification.estimators.noisy_columns import (
    InstrumentalVariables,
    MaximumLikelihood,
    TotalLeastSquares,
    column_noise,
    reference_instruments,
)
from armlab.identification.estimators.physical import PhysicalEstimate, PhysicalLeastSquares
from armlab.identification.model import Model
from armlab.identification.priors import NO_PULL, Pull
from armlab.identification.recorded_motion import RecordedMotion
from armlab.identification.regression import (
    Regression,
    regression,
    require_rows,
    signals_of,
    suggested_cutoff,
)
from armlab.identification.selection import with_load
from armlab.identification.structure import Structure
from armlab.recordings.differentiate import Signals
from armlab.recordings.plain_least_squares import PlainLayout
from armlab.recordings.recording import Run
from problem.arm import Arm

USUAL_METHOD = "weighted"
LOAD_TOLERANCE = 1e-8  # of the links, between two of these rounds
MAX_LOAD_ROUNDS = 12  # of load-dependent friction that follows the fitted links themselves
PreparedData = tuple[Structure, Sequence[Signals], Regression]


def _draw_column_noise(fitted: PreparedData) -> Array:
    structure, signals, _ = fitted
    rng = np.random.default_rng(0)
    return np.concatenate([column_noise(structure, each, rng) for each in signals], axis=1)


def _stack_instruments(fitted: PreparedData) -> Array:
    return np.vstack([reference_instruments(fitted[0], each) for each in fitted[1]])


def fastest_speeds(signals: Sequence[Signals]) -> Array:
    """The top speed of each joint over all runs, (joints,), rad/s (m/s)."""
    return np.asarray(np.max([np.abs(each.motion.velocity).max(axis=0) for each in signals], axis=0))


def _bayesian_estimator(fitted: PreparedData, pull: Pull, by_joint: bool = True) -> Estimator:
    prior = pull.prior(fitted[0], fitted[2])
    if prior is not None:
        return BayesianLeastSquares(prior, by_joint)
    return WeightedLeastSquares() if by_joint else OrdinaryLeastSquares()


def _plain_coordinates(structure: Structure) -> Array:
    """Unknowns of plain least squares: each a parameter of a link, the last links first, or of a component.

    Base parameters are sums over links. Directions of single bodies that a short motion hardly excites are fewer.
    """
    arm, links = structure.arm, len(structure.base)
    layout = PlainLayout(arm, tuple(range(len(arm))), np.ones(len(arm)))
    chosen = layout.columns[layout.columns < 10 * len(arm)]
    return np.asarray(block_diag(structure.base.grouping[:, chosen], np.eye(structure.size - links)))


METHODS: dict[str, Callable[[PreparedData, Pull], Estimator]] = {
    "ordinary": lambda fitted, pull: OrdinaryLeastSquares(),
    "alike": lambda fitted, pull: _bayesian_estimator(fitted, pull, by_joint=False),
    "weighted": _bayesian_estimator,
    "excited": lambda fitted, pull: WeightedLeastSquares(
        tolerance=EXCITED_TOLERANCE, coordinates=_plain_coordinates(fitted[0])
    ),
    "huber": lambda fitted, pull: RobustLeastSquares("huber"),
    "tukey": lambda fitted, pull: RobustLeastSquares("tukey"),
    "total": lambda fitted, pull: TotalLeastSquares(_draw_column_noise(fitted)),
    "likelihood": lambda fitted, pull: MaximumLikelihood(_draw_column_noise(fitted)),
    "instrumental": lambda fitted, pull: InstrumentalVariables(_stack_instruments(fitted)),
    "physical": lambda fitted, pull: PhysicalLeastSquares(fitted[0], fastest_speeds(fitted[1]), pull),
}


@dataclass
class Identifier:
    """Identifies an arm from runs.

    components: viscous and Coulomb friction, rotor inertia and offset at each joint if left out. method: one of
    METHODS. pull: the prior of `weighted` (joints weighted by their errors), `alike` (not) and `physical`.
    cutoff_hz: chosen from the positions if left out. position_factor: see `signals_of`.
    After `fit`: model_, condition_number_ (columns at unit length), absorbed_ (components that no motion separates
    from the others, left out), estimate_.
    """

    arm: Arm
    components: tuple[Candidate, ...] | None = None
    method: str = USUAL_METHOD
    pull: Pull = NO_PULL
    cutoff_hz: float | None = None
    robot: str | None = None
    position_factor: float = 1.0
    model_: Model = field(init=False)
    condition_number_: float = field(init=False)
    absorbed_: tuple[Candidate, ...] = field(init=False, default=())
    estimate_: Estimate = field(init=False)

    def fit(self, runs: Sequence[Run]) -> "Identifier":
        """Identifies from all runs together; ValueError for runs that do not fit the arm."""
        structure, signals, data = self.prepare(runs)
        if self.pull.kind == NO_PULL.kind:
            require_rows(data)
        cutoff = signals[0].filter.cutoff_hz
        for _ in range(MAX_LOAD_ROUNDS):
            estimate = METHODS[self.method]((structure, signals, data), self.pull)(data)
            if structure.load is None:
                break
            load = structure.full(estimate.values[: len(structure.base)])
            if np.linalg.norm(load - structure.load) <= LOAD_TOLERANCE * np.linalg.norm(load):
                break
            structure = replace(structure, load=load)
            data = regression(structure, signals)
        self._keep(structure, data, estimate, cutoff)
        scenes = [scene_of(each.run, each.motion, self.arm) for each in signals]
        self.model_ = replace(self.model_, motion=RecordedMotion.of(scenes, self.model_.links))
        return self

    def prepare(self, runs: Sequence[Run]) -> PreparedData:
        """The structure, signals and regression from which `fit` starts."""
        cutoff = self.cutoff_hz or max(suggested_cutoff(run) for run in runs)
        signals = [signals_of(run, cutoff, self.position_factor) for run in runs]
        structure = with_load(self._structure(), signals)
        return structure, signals, regression(structure, signals)

    def held_out_errors(self, fitted: PreparedData) -> Array:
        """Rms error of each joint, (joints,), N m (N), on blocks of the runs that are held out in turn."""
        return held_out_errors(fitted[2], METHODS[self.method](fitted, self.pull))

    @property
    def manner(self) -> str:
        """Method and prior, as a reader is told."""
        told = {
            "weighted": "least squares",
            "excited": "plain least squares, in the directions that the motion excites",
            "physical": "physically consistent bodies and friction",
        }
        prior = "" if self.pull == NO_PULL else ", drawn to the links of the robot file"
        return f"{told.get(self.method, self.method)}{prior}"

    def _structure(self) -> Structure:
        components = usual_components(self.arm) if self.components is None else self.components
        whole = Structure(self.arm, components)
        if self.pull.kind == "nominal":  # the prior separates what no motion does
            return whole
        kept, self.absorbed_ = whole.separable()
        return kept

    def _keep(self, structure: Structure, data: Regression, estimate: Estimate, cutoff: float) -> None:
        spread = uncertainty(data, estimate)
        inertial = estimate.inertial if isinstance(estimate, PhysicalEstimate) else None
        settings = {"method": self.method, "prior": str(self.pull), "error_correlation_s": spread.lag_s}
        self.estimate_ = estimate
        self.condition_number_ = _column_condition(data)
        self.model_ = Model(
            self.robot or self.arm.name,
            structure,
            estimate.values,
            spread.covariance,
            spread.factor,
            inertial,
            cutoff,
            self.position_factor,
            {"settings": settings},
        )

    def predict(self, run: Run) -> Array:
        """Torque at every sample of a run, (samples, joints), N m (N)."""
        return self.model_.predict(run)

    def score(self, run: Run) -> float:
        """Coefficient of determination of the filtered torque over all joints; 1 is perfect."""
        signals = self.model_.signals(run)
        left = signals.torque - self.model_.filtered_torque(signals)
        spread = signals.torque - signals.torque.mean(axis=0)
        return float(1 - np.sum(left**2) / np.sum(spread**2))


def _column_condition(data: Regression) -> float:
    """Condition number of the columns at unit length; directions that only a prior determines do not count."""
    sizes = np.linalg.svd(np.linalg.qr(data.matrix / column_lengths(data.matrix))[1], compute_uv=False)
    return float(sizes[0] / sizes[sizes > RANK_TOLERANCE * sizes[0]][-1])
