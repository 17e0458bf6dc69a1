"""Instrumental variables: columns of a motion that the noise did not touch (Janot, Vandanjon and Gautier 2014).

In closed loop the torque answers to encoder noise, so errors and columns are tied; instruments are not.
"""

from dataclasses import dataclass, replace

import numpy as np

from identification.estimators.estimate import Estimate, lengths_of
from identification.regression import Regression, once_more
from identification.structure import Structure
from recordings.differentiate import Signals
from recordings.run import Array


def reference_instruments(structure: Structure, signals: Signals) -> Array:
    """Columns along the reference motion, (kept * joints, columns).

    Raises ValueError for a run without `reference_position`.
    """
    run = signals.run
    if run.reference_position is None:
        raise ValueError(f"{run.name} has no reference_position: instruments need a motion that noise did not touch")
    return structure.filtered(once_more(signals, replace(run, position=run.reference_position)))


@dataclass(frozen=True, eq=False)
class InstrumentalVariables:
    """instruments: (samples * joints, columns), correlated with the columns, not with the errors."""

    instruments: Array

    def __call__(self, data: Regression) -> Estimate:
        """The estimate at which the residual is orthogonal to the instruments."""
        left, right = lengths_of(self.instruments), lengths_of(data.matrix)
        cross = (self.instruments / left).T @ (data.matrix / right)
        bread = np.linalg.pinv(cross, rcond=1e-10) / right[:, None] / left
        return Estimate(bread @ (self.instruments.T @ data.torque), bread, self.instruments)
