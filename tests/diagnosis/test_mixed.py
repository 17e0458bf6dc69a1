"""Least squares with random drift, as a comparison has them."""

import numpy as np
from numpy.testing import assert_allclose

from armlab.diagnosis.changes.mixed import JointRows, MixedModel, weigh_rows

ROWS = 300


def rows_with(drift: float, noise: float) -> JointRows:
    """Two runs of a joint whose level wanders; one of three columns follows the drift almost exactly."""
    rng = np.random.default_rng(0)
    runs = np.repeat([0, 1], ROWS // 2)
    waves = np.column_stack([np.sin(np.arange(ROWS) * order / 50) for order in (1, 2, 3)])
    columns = np.column_stack([waves[:, 0] + 1e-9 * rng.normal(size=ROWS), rng.normal(size=(ROWS, 2))])
    target = drift * waves @ rng.normal(size=3) + noise * rng.normal(size=ROWS)
    none = np.zeros((ROWS, 0))
    kind = np.ones(3, dtype=bool)
    return JointRows(
        columns, np.arange(3), target, (waves,), kind, none, np.arange(ROWS) // 30, runs, runs, np.ones(ROWS)
    )


def test_whitening_is_the_root_of_the_inverse_covariance() -> None:
    weighted = weigh_rows(rows_with(1.0, 0.1))
    covariance = weighted.variance * (np.eye(ROWS) + weighted.drift @ weighted.drift.T)
    values = np.random.default_rng(1).normal(size=(ROWS, 4))
    assert_allclose(weighted.whiten(weighted.whiten(values)), np.linalg.solve(covariance, values), rtol=1e-6)


def test_a_drift_that_explains_nearly_everything_leaves_no_negative_information() -> None:
    model = MixedModel((weigh_rows(rows_with(1e6, 1e-6)),), 3, np.zeros(3))
    size = np.sqrt(np.diag(model.information))
    assert np.linalg.eigvalsh(model.information / np.outer(size, size)).min() > -1e-12
