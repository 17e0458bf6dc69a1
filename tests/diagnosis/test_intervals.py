"""Intervals of numbers that data do not tell."""

import engine_cases as cases
import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.columns.solver import State
from armlab.diagnosis.torque.diagnose import prepare
from armlab.diagnosis.torque.names.intervals import extend_with_shapes
from armlab.diagnosis.torque.search.fitted_model import FittedModel, fit_background
from armlab.effects.library import library
from problem.motion import Motion


def coulomb_friction(motion: Motion, time: Array) -> Array:
    torque = np.zeros(motion.position.shape)
    torque[:, 1] = 2.0 * np.sign(motion.velocity[:, 1])
    return torque


def test_a_shape_is_as_uncertain_as_its_bounds_are_wide_at_most() -> None:
    """A lead of less than a sample changes nothing but the size of the impulse."""
    design = prepare(cases.recording(coulomb_friction, seconds=6.0), None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    found = fit_background(design, library(), 0, lambda message: None)
    laws = [each.candidate for each in found.solver.groups]
    group = next(
        at for at, law in enumerate(laws) if (law.effect, law.joint, law.shape) == ("early_friction", 2, (0.003,))
    )
    model = FittedModel(found.design, found.noise, found.moments, found.solver, State((group,), (0.0,) * 3))
    impulse, lead = np.sqrt(np.diag(extend_with_shapes(model).covariance(group)))
    ((low, high),) = laws[group].bounds
    assert 0.9 < lead / ((high - low) / np.sqrt(12)) < 1.01
    assert 0 < impulse < 0.01
