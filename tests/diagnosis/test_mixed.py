"""Least squares with random drift, as a comparison has them."""

import numpy as np
from numpy.testing import assert_allclose

from armlab.diagnosis.changes.mixed import JointRows, MixedModel, weigh_rows

ROWS = 300


def rows_with(known: float, noise: float) -> JointRows:
    """Two runs of a joint whose level wanders, and a known drift of which one of three columns is nearly a part."""
    rng = np.random.default_rng(0)
    runs = np.repeat([0, 1], ROWS // 2)
    waves = np.column_stack([np.sin(np.arange(ROWS) * order / 50) for order in (1, 2, 3)])
    columns = np.column_stack([waves[:, 0] + 1e-9 * rng.normal(size=ROWS), rng.normal(size=(ROWS, 2))])
    target = waves @ rng.normal(size=3) + noise * rng.normal(size=ROWS)
    return JointRows(
        columns=columns,
        index=np.arange(3),
        target=target,
        random=(waves[:, 1:],),
        waves=np.ones(2, dtype=bool),
        known=known * waves[:, :1],
        stretches=np.arange(ROWS) // 30,
        runs=runs,
        members=runs,
        weights=np.ones(ROWS),
    )


def test_whitening_is_the_root_of_the_inverse_covariance() -> None:
    weighted = weigh_rows(rows_with(1.0, 0.1))
    covariance = weighted.variance * (np.eye(ROWS) + weighted.drift @ weighted.drift.T)
    values = np.random.default_rng(1).normal(size=(ROWS, 4))
    assert_allclose(weighted.whiten(weighted.whiten(values)), np.linalg.solve(covariance, values), rtol=1e-6)


def test_a_drift_that_explains_nearly_everything_leaves_no_negative_information() -> None:
    model = MixedModel((weigh_rows(rows_with(1e3, 1e-5)),), 3, np.zeros(3))
    size = np.sqrt(np.diag(model.information)[:3])
    assert np.linalg.eigvalsh(model.information[:3, :3] / np.outer(size, size)).min() > 0
