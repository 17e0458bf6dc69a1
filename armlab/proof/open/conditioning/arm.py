"""One arm: its parameters identified from every window of its identification run, real and simulated torque alike."""

from dataclasses import dataclass

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.streams import named_generator
from armlab.effects.contract import Candidate
from armlab.identification.components import usual_components
from armlab.identification.estimators.least_squares import least_squares
from armlab.identification.identifier import Identifier
from armlab.identification.regression import Regression, regression, signals_of
from armlab.identification.selection import counterbalance_groups
from armlab.proof.open.conditioning.criteria import window_criteria
from armlab.proof.open.conditioning.windows import BLOCKS, RunWindows, block_rows
from armlab.proof.open.real_identification.identify_recording import Recipe
from armlab.recordings.recording import Recording
from problem.arm import Arm

WINDOW_BLOCKS = (4, 6, 8)  # of BLOCKS: a third, a half and two thirds of the run
SIMULATIONS = 100  # draws of the noise


@dataclass(frozen=True, eq=False)
class ArmWindows:
    """All windows of one length of one arm.

    criteria: one row a window, columns as CRITERIA. errors: (windows,), percent of the filtered torque on the runs that
    validate. simulated: (windows, simulations), the same of the known model. window_s: the length of a window, s.
    """

    windows: RunWindows
    window_s: float
    criteria: pd.DataFrame
    errors: Array
    simulated: Array


@dataclass(frozen=True, eq=False)
class ConditioningStudy:
    """An arm with its windows of every length.

    base, columns: base parameters, and all columns that are fitted. whole_error: percent, of the fit to the whole run.
    """

    name: str
    cutoff_hz: float
    base: int
    columns: int
    run_s: float
    whole_error: float
    lengths: tuple[ArmWindows, ...]


@dataclass(frozen=True, eq=False)
class JudgedTorque:
    """The torque to be predicted, of which only the part within the columns' reach depends on the parameters.

    triangle: (columns, columns), R of the matrix. inside: (columns, series), Q' tau. outside: (series,), the squared
    length of what no parameters reach. power: (series,), the squared length of the torque.
    """

    triangle: Array
    inside: Array
    outside: Array
    power: Array

    @staticmethod
    def of(matrix: Array, torques: Array) -> "JudgedTorque":
        """torques: (rows, series), each predicted with the same matrix (rows, columns)."""
        basis, triangle = np.linalg.qr(matrix)
        inside = basis.T @ torques
        outside = np.sum((torques - basis @ inside) ** 2, axis=0)
        return JudgedTorque(triangle, inside, outside, np.sum(torques**2, axis=0))

    def percent(self, values: Array) -> Array:
        """||tau - Z values|| / ||tau|| of values (columns, series), one a series, in percent; (series,)."""
        left = np.sum((self.inside - self.triangle @ values) ** 2, axis=0) + self.outside
        return np.asarray(100 * np.sqrt(left / self.power))


def plain_components(arm: Arm, recipe: Recipe) -> tuple[Candidate, ...]:
    """Viscous and Coulomb friction, rotor inertia and offset at each joint, and the counterbalance that is known."""
    if recipe.counterbalanced is None:
        return usual_components(arm)
    spring = counterbalance_groups(arm, recipe.counterbalanced)["spring"]
    return (*spring, *usual_components(arm))  # first, so that it takes the place of the offset of its joint


def study_arm(recipe: Recipe, recording: Recording, simulations: int = SIMULATIONS) -> ConditioningStudy:
    """Identifies every window by ordinary least squares and judges it on the runs that validate.

    The whole run passes the filters before it is cut, so that a window has no ends of its own. Nothing is chosen or
    fitted on the runs that validate.
    """
    identifier = Identifier(recording.arm, plain_components(recording.arm, recipe), "ordinary")
    structure, signals, data = identifier.prepare(recording.with_role("identify"))
    cutoff = signals[0].filter.cutoff_hz
    runs = recording.with_role("validate")
    judged = regression(structure, [signals_of(run, cutoff) for run in runs])
    fitted = least_squares(data.matrix, data.torque)
    rng = named_generator("conditioning", recipe.name)
    torques = np.column_stack([data.torque, simulated_torques(data, fitted, simulations, rng)])
    to_predict = np.column_stack([judged.torque, simulated_torques(judged, fitted, simulations, rng)])
    target = JudgedTorque.of(judged.matrix, to_predict)
    lengths = tuple(
        _study_windows(RunWindows(chosen), data, torques, len(structure.base), target) for chosen in WINDOW_BLOCKS
    )
    whole = float(target.percent(least_squares(data.matrix, torques))[0])
    return ConditioningStudy(
        recipe.name, cutoff, len(structure.base), structure.size, data.samples / data.rate_hz, whole, lengths
    )


def simulated_torques(data: Regression, values: Array, simulations: int, rng: np.random.Generator) -> Array:
    """Torque of a known model with noise of the size and colour of what it leaves of the recorded one.

    values: (columns,), of the known model. Returns (samples * joints, simulations). The noise is the residual with
    random phases, the same at all joints, which keeps every spectrum and cross-spectrum (Prichard and Theiler 1994);
    its power is raised by what the fit has taken out.
    """
    left = data.residuals(values)
    spare = data.matrix.shape[0] / max(data.matrix.shape[0] - data.matrix.shape[1], 1)
    spectrum = np.fft.rfft(left, axis=0) * np.sqrt(spare)
    phases = rng.uniform(0, 2 * np.pi, (simulations, len(spectrum), 1))
    phases[:, 0] = 0.0  # the mean stays
    if data.samples % 2 == 0:
        phases[:, -1] = 0.0  # so does the highest frequency, which is real
    noise = np.fft.irfft(spectrum * np.exp(1j * phases), data.samples, axis=1)
    return np.asarray((data.matrix @ values)[:, None] + noise.reshape(simulations, -1).T)


def _study_windows(
    windows: RunWindows, data: Regression, torques: Array, base: int, target: JudgedTorque
) -> ArmWindows:
    blocks = [_compress(data.matrix[rows], torques[rows]) for rows in block_rows(data.samples, data.joints)]
    errors, criteria = np.empty((len(windows), torques.shape[1])), []
    for number, members in enumerate(windows.members):
        matrix = np.concatenate([blocks[block][0] for block in members])
        inside = np.concatenate([blocks[block][1] for block in members])
        criteria.append(window_criteria(np.asarray(np.linalg.qr(matrix, mode="r")), base, target.triangle))
        errors[number] = target.percent(least_squares(matrix, inside))
    seconds = windows.chosen * (data.samples // BLOCKS) / data.rate_hz
    return ArmWindows(windows, seconds, pd.DataFrame(criteria), errors[:, 0], errors[:, 1:])


def _compress(matrix: Array, torques: Array) -> tuple[Array, Array]:
    """R and Q' tau of a block: far fewer rows, with the same singular values and the same least squares."""
    basis, triangle = np.linalg.qr(matrix)
    return triangle, basis.T @ torques
