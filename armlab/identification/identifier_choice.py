"""Which estimator identifies: the one that predicts best on blocks of the runs that identify, left out in turn.

Least squares with every direction, without directions that the motion hardly excites, and drawn to the links of the
robot file from afar. Short motion leaves directions open along which least squares alone goes to bodies of tons; a wide
prior holds these where an arm can be, and what the data tell stays as it is.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from armlab.identification.identifier import Identifier
from armlab.identification.priors import Pull
from armlab.recordings.recording import Run
from problem.arm import Arm

WIDE_TOLERANCE = 10.0  # of a prior about the robot file's links: bodies may be so many times as large
MIN_GAIN = 0.01  # of the mean logarithm of the joints' errors: what another estimator than the first has to lower it by


def choose_identifier(arm: Arm, runs: Sequence[Run], cutoff_hz: float, robot: str) -> Identifier:
    """The usual identifier, or the best of the others where it predicts held-out blocks better by `MIN_GAIN` at least.

    robot: the robot file, as in `Identifier`. Raises ValueError for runs that do not fit the arm.
    """
    usual = Identifier(arm, cutoff_hz=cutoff_hz, robot=robot)
    first, *others = _scored([usual, replace(usual, method="excited")], runs)
    if arm.links is not None:
        others += _scored([replace(usual, pull=Pull("nominal", WIDE_TOLERANCE))], runs)
    best = min(others, key=lambda each: each[0])
    return best[1] if best[0] < first[0] - MIN_GAIN else first[1]


def _scored(identifiers: Sequence[Identifier], runs: Sequence[Run]) -> list[tuple[float, Identifier]]:
    """Identifiers of the same columns, each with the mean logarithm of the joints' errors on held-out blocks.

    A small joint counts as a large one.
    """
    fitted = identifiers[0].prepare(runs)
    errors = ((each.held_out_errors(fitted), each) for each in identifiers)
    return [(float(np.mean(np.log(np.maximum(own, 1e-300)))), each) for own, each in errors]
