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


def squared_errors(plain: Yardstick, observed: Observed, block: NDArray[np.intp]) -> Array:
    """Of plain least squares on blocks left out in turn, summed over the rows that identify, (joints,).

    observed, block: the rows that judge, and the block of each. Raises ValueError where no rows are left.
    """
    identify, layout = rows_in(observed.of_role("identify"), observed.rows), plain.model.layout
    ends = np.cumsum([len(each.torque) for each in observed.signals])
    blocks = np.split(np.where(identify, block, -1), ends[:-1])  # of each run
    sums: list[list[NormalEquations]] = [[] for _ in range(int(block.max()) + 1)]
    for signals, own in zip(observed.signals, blocks, strict=True):
        rows = prepare_rows(signals.run, plain.cutoff_hz)
        near, matrix = np.searchsorted(signals.time, rows.time), layout.matrix(rows.motion)
        of_row = own[np.clip(near, 0, len(own) - 1)]
        for number in np.unique(of_row[of_row >= 0]).tolist():
            chosen = of_row == number
            sums[number].append(NormalEquations.of(matrix[chosen], rows.torque[chosen]))
    values = []
    for left_out in range(len(sums)):
        others = [each for number, parts in enumerate(sums) if number != left_out for each in parts]
        if not others:
            raise DataError("too few rows to leave a block out")
        values.append(sum_equations(others).solve()[0])
    model, errors = PlainModel(layout, plain.cutoff_hz, np.column_stack(values)), np.zeros(observed.joints)
    for signals, own in zip(observed.signals, blocks, strict=True):
        predicted = signals.filter(model.predict(signals.run))[np.arange(len(own)), :, own]  # without the own block
        errors += np.sum((signals.torque - predicted)[own >= 0] ** 2, axis=0)
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
