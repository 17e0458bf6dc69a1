"""The best trajectory of a search, and the simulated identification on it (Table 4): encoders and torques with noise,
linear least squares (eq. 43).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import butter, sosfiltfilt

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.streams import named_generator
from bench.execute import build_problem
from bench.plan import Entry
from bench.store import RunStore
from bench.studies.paper.paper_settings import Table4Settings
from problem.arm import Arm
from problem.excitation import ExcitationProblem
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque
from problem.trajectories import sample_instants


@dataclass(frozen=True, eq=False)
class BestRun:
    """point: (dimension,), the best feasible end of all repetitions; value: its condition number."""

    problem: ExcitationProblem
    algorithm: str
    repetition: int
    point: Array
    value: float

    def motion(self, times: Array) -> Motion:
        """The joint motion (samples, joints) at instants (samples,), s."""
        return self.problem.trajectory.motions(self.point[None], times).motion.select(np.intp(0))

    @property
    def title(self) -> str:
        """The origin of the trajectory, for the reader of a figure."""
        return f"repetition {self.repetition} of the search, condition number {self.value:.3g}"


def find_best_run(entries: Sequence[Entry], store: RunStore, algorithm: str) -> BestRun:
    """The run with the least condition number among the feasible ends of an algorithm.

    Raises InputError where there is none, or the problem is no excitation.
    """
    ends = [(entry, store.get(entry.key)) for entry in entries if entry.algorithm == algorithm]
    feasible = [(entry, end) for entry, end in ends if end.violation == 0 and np.isfinite(end.value)]
    if not feasible:
        raise InputError(f"no feasible run of '{algorithm}' to show: name another algorithm of the experiment")
    entry, end = min(feasible, key=lambda pair: pair[1].value)
    problem = build_problem(entry.trial.problem)
    if not isinstance(problem, ExcitationProblem):
        raise InputError(f"'{entry.problem}' is no excitation problem in its own coordinates")
    return BestRun(problem, algorithm, entry.trial.repetition, end.best_x, end.value)


@dataclass(frozen=True, eq=False)
class SimulatedIdentification:
    """Base parameters (n,) of a simulated experiment, SI.

    exact: without noise. estimates: (repetitions, n), with noise. predicted: (n,), their standard deviation as least
    squares itself predicts it, on average. individual: (10 * joints,), all parameters at once without noise, the
    solution of least norm.
    """

    true: Array
    exact: Array
    estimates: Array
    predicted: Array
    individual: Array

    @property
    def relative_error(self) -> Array:
        """Of the exact estimates: error against the true value, or against the mean true value where that is 0."""
        scale = np.where(np.abs(self.true) > 0, np.abs(self.true), np.abs(self.true).mean())
        return np.asarray(np.abs(self.exact - self.true) / scale)

    @property
    def bias(self) -> Array:
        """Mean error of the estimates, (n,)."""
        return np.asarray(self.estimates.mean(axis=0) - self.true)

    @property
    def spread(self) -> Array:
        """Sample standard deviation of the estimates, (n,)."""
        return np.asarray(self.estimates.std(axis=0, ddof=1))


def simulate_identification(settings: Table4Settings, run: BestRun) -> SimulatedIdentification:
    """Simulate the experiment on a trajectory and identify the arm's base parameters from it."""
    problem, arm = run.problem, run.problem.arm
    motion = run.motion(_sample_times(settings, run))
    torque = rigid_body_torque(arm, motion)
    matrix = observation_matrix(arm, motion)
    columns = problem.base.columns
    rng = named_generator(settings.name, settings.seed)
    noisy = [_estimate_with_noise(settings, run, rng) for _ in range(settings.repetitions)]
    return SimulatedIdentification(
        true=problem.base.values(arm.parameters),
        exact=least_squares(matrix[:, columns], torque.ravel())[0],
        estimates=np.array([estimate for estimate, _ in noisy]),
        predicted=np.mean([deviation for _, deviation in noisy], axis=0),
        individual=np.asarray(np.linalg.lstsq(matrix, torque.ravel(), rcond=1e-10)[0], dtype=np.float64),
    )


def least_squares(matrix: Array, torque: Array) -> tuple[Array, Array]:
    """Estimates (n,) of eq. 43 and their standard deviations (n,), for independent errors of one size."""
    q, r = np.linalg.qr(matrix)
    estimate = np.linalg.solve(r, q.T @ torque)
    residual = torque - matrix @ estimate
    variance = residual @ residual / (len(torque) - len(estimate))
    back = np.linalg.inv(r)
    return estimate, np.sqrt(variance * np.square(back).sum(axis=1))


def _sample_times(settings: Table4Settings, run: BestRun) -> Array:
    return sample_instants(run.problem.duration, round(run.problem.duration * settings.sample_rate_hz) + 1)


def _estimate_with_noise(settings: Table4Settings, run: BestRun, rng: np.random.Generator) -> tuple[Array, Array]:
    """One experiment: the encoder's zero lies anywhere within a count, and the noise of the torque is white."""
    arm, times = run.problem.arm, _sample_times(settings, run)
    motion = run.motion(times)
    torque = rigid_body_torque(arm, motion)
    count = 2 * np.pi / settings.encoder_counts
    zero = rng.uniform(0, count, len(arm))
    encoder = np.round((motion.position + zero) / count) * count - zero
    measured = torque + rng.normal(0, settings.torque_noise, torque.shape)
    matrix, right = _process_measurement(settings, arm, encoder, measured)
    return least_squares(matrix[:, run.problem.base.columns], right)


def _process_measurement(settings: Table4Settings, arm: Arm, encoder: Array, torque: Array) -> tuple[Array, Array]:
    """Filtered, differentiated by central differences and decimated: observation matrix and torques."""
    low_pass = butter(4, settings.cutoff_hz, fs=settings.sample_rate_hz, output="sos")
    position = sosfiltfilt(low_pass, encoder, axis=0)
    velocity = np.gradient(position, 1 / settings.sample_rate_hz, axis=0)
    acceleration = np.gradient(velocity, 1 / settings.sample_rate_hz, axis=0)
    kept = slice(None, None, settings.decimation)
    motion = Motion(position[kept], velocity[kept], acceleration[kept])
    return observation_matrix(arm, motion), sosfiltfilt(low_pass, torque, axis=0)[kept].ravel()
