"""Plain least squares beside the model that predicts: the choice between them, inside the runs that identify.

Both predict the same rows on blocks of time that are left out in turn, behind one filter. Where plain least squares
predicts them better, over the joints and by more than a small share, it is what is delivered. Runs that validate take
no part in the choice.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.diagnosis.torque.rows.data import Observed, identification_runs, rows_in
from armlab.effects.scene import instants
from armlab.identification.components import usual_components
from armlab.identification.estimators.least_squares import least_squares
from armlab.identification.identifier import Identifier
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.cutoff_trial import choose_cutoff_hz
from armlab.recordings.plain_least_squares import (
    NormalEquations,
    PlainLayout,
    PlainModel,
    fit_plain_rows,
    prepare_rows,
    sum_equations,
)
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion

ROUNDING = 1e-12  # of the largest singular value
PROBE_STATES = 200  # random states in which a model has the torque of plain least squares


@dataclass(frozen=True, eq=False)
class Yardstick:
    """Plain least squares on the runs that identify. cutoff_hz: that predicts best inside them."""

    model: PlainModel
    cutoff_hz: float

    def residual(self, observed: Observed) -> Array:
        """What it leaves behind the filter of the torque, (rows, joints), N m (N)."""
        return np.concatenate([each.torque - each.filter(self.model.predict(each.run)) for each in observed.signals])

    def as_torque_model(self, runs: Sequence[Run]) -> TorqueModel:
        """The same as a model that goes to files; intervals are of the identification with the same terms.

        Which of several dependent columns are left out differs between the two; the torque does not.
        """
        plain, arm = self.model, self.model.layout.arm
        components = usual_components(arm, plain.layout.top_speed)
        fitted = Identifier(arm, components, cutoff_hz=self.cutoff_hz).fit(runs).model_
        states = Motion(*np.random.default_rng(0).uniform(-1, 1, (3, PROBE_STATES, len(arm))))
        torque = plain.layout.matrix(states) @ plain.values
        values = least_squares(fitted.structure.matrix(instants(arm, states)), torque.ravel(), ROUNDING)
        return TorqueModel(**(vars(fitted) | {"values": values}))


def fit_yardstick(arm: Arm, observed: Observed) -> Yardstick | None:
    """None where the stretches that identify are too short."""
    runs = identification_runs(observed)
    try:
        cutoff = choose_cutoff_hz(arm, runs)
        return Yardstick(fit_plain_rows(arm, [prepare_rows(run, cutoff) for run in runs], cutoff), cutoff)
    except DataError:
        return None


def squared_errors(arm: Arm, observed: Observed, block: NDArray[np.intp], cutoff_hz: float) -> Array:
    """Of plain least squares on blocks left out in turn, summed over the rows that identify, (blocks, joints).

    observed, block: the rows that judge, and the block of each. Raises ValueError where too few rows are left.
    """
    identify = rows_in(observed.of_role("identify"), observed.rows)
    own_rows = np.split(np.arange(observed.rows), np.cumsum([len(each.torque) for each in observed.signals])[:-1])
    fitted = []  # of each run its rows, and the block of each, -1 where it does not identify
    for signals, own in zip(observed.signals, own_rows, strict=True):
        rows = prepare_rows(signals.run, cutoff_hz)
        near = own[np.clip(np.searchsorted(signals.time, rows.time), 0, len(own) - 1)]
        fitted.append((rows, np.where(identify[near], block[near], -1)))
    numbers, found = np.unique(block[identify]), np.unique(np.concatenate([own for _, own in fitted]))
    if len(found[found >= 0]) < 2:
        raise DataError("too few rows to leave blocks out")
    speeds = [np.abs(rows.motion.velocity[own >= 0]).max(axis=0, initial=0.0) for rows, own in fitted]
    layout = PlainLayout(arm, tuple(range(len(arm))), np.max(speeds, axis=0))
    sums: dict[int, list[NormalEquations]] = {number: [] for number in numbers.tolist()}
    for rows, own in fitted:
        matrix = layout.matrix(rows.motion)
        for number in np.unique(own[own >= 0]).tolist():
            sums[number].append(NormalEquations.of(matrix[own == number], rows.torque[own == number]))
    values = [
        sum_equations([each for number in sums if number != left_out for each in sums[number]]).solve()[0]
        for left_out in sums
    ]
    errors = np.zeros((len(numbers), observed.joints))
    for signals, own in zip(observed.signals, own_rows, strict=True):
        predicted = PlainModel(layout, cutoff_hz, np.column_stack(values)).predict(signals.run)
        left = signals.torque[:, :, None] - signals.filter(predicted)
        for place, number in enumerate(numbers):
            errors[place] += np.sum(left[identify[own] & (block[own] == number), :, place] ** 2, axis=0)
    return errors


def predicts_better(one: Array, other: Array, least: float) -> bool:
    """Whether squared errors (joints,) are smaller than others: their roots by more than a share, as the mean of the
    joints' logarithms has it.
    """
    ratio = np.log(np.maximum(one, 1e-300)) - np.log(np.maximum(other, 1e-300))
    return bool(np.mean(ratio) / 2 < np.log(1 - least))


def with_claims(model: TorqueModel, claimed: Sequence[tuple[str, int | None]]) -> TorqueModel:
    """The model with the components marked that no finding names. claimed: effects and joints of the findings."""
    parts = enumerate(model.structure.components)
    return replace(model, unclaimed=frozenset(at for at, part in parts if (part.effect, part.joint) not in claimed))
