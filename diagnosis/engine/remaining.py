"""What the library leaves: structure that a surrogate predicts on data that took no part."""

import numpy as np

from diagnosis.engine.evidence import Evidence
from diagnosis.engine.noise import Noise
from diagnosis.engine.rounds import Round
from diagnosis.engine.segments import rows_of
from diagnosis.engine.solver import State
from diagnosis.engine.surrogate import SMALL, Structure, structure
from diagnosis.next_experiment import next_experiment
from diagnosis.result import Claim
from recordings.run import Array

UNKNOWN_LEVEL = 0.02  # of the test between stretches of time, which few strong ones hardly pass: the gain is the bar
LARGE, LARGE_LEVEL = 0.1, 0.05  # a gain for which a weaker test is enough


def structures(found: Round, noise: Noise) -> tuple[Structure, ...]:
    """What surrogates predict of each joint's residual, friction and offsets fitted that may not be claimed."""
    usual = {number for number, unusual in enumerate(found.solver.unusual) if not unusual}
    state = State(tuple(sorted({*found.state.groups, *usual})), found.state.widths)
    residual = found.residual(found.solver.fit(state))
    observed = found.bench.observed
    return tuple(
        structure(residual[:, joint], joint, each, noise, observed) for joint, each in enumerate(found.bench.features)
    )


def structured(each: Structure) -> bool:
    """Whether it is more than chance, and large enough to matter."""
    return each.gain > SMALL and each.p_value < (LARGE_LEVEL if each.gain > LARGE else UNKNOWN_LEVEL)


def unknown_claim(found: Round, each: Structure, residual: Array) -> Claim:
    """The finding `unknown` at a joint, with its surrogate's prediction."""
    observed = found.bench.observed
    rows = rows_of(observed.of_role("validate", each.joint), observed.rows)
    before = float(np.sqrt(np.mean(residual[rows, each.joint] ** 2)))
    after = float(np.sqrt(np.mean((residual[rows, each.joint] - each.prediction[rows]) ** 2)))
    tried = observed.joints
    evidence = Evidence(
        each.joint, each.p_value, min(1.0, each.p_value * tried), each.gain, each.p_value, each.validated,
        before, after,
        -0.5 * len(residual) * float(np.log(max(1 - each.gain, 1e-6))),
    )  # fmt: skip
    prediction = np.zeros(residual.shape)
    prediction[:, each.joint] = each.prediction
    joint = each.joint + 1
    return Claim(
        "unknown", joint, (joint,), (), f"tau_{joint} += f({', '.join(each.depends_on)})", evidence, prediction,
        next_experiment=next_experiment("unknown", ()), depends_on=each.depends_on,
    )  # fmt: skip
