"""What the library leaves: structure that surrogates predict on data that took no part.

One surrogate has features of everything, and others a few of one kind of dependence each; the surest speaks.
"""

from dataclasses import replace

import numpy as np

from diagnosis.engine.evidence import Evidence
from diagnosis.engine.flexible import families
from diagnosis.engine.noise import Noise
from diagnosis.engine.rounds import Round
from diagnosis.engine.segments import rows_of
from diagnosis.engine.solver import State
from diagnosis.engine.surrogate import SMALL, Structure, structure
from diagnosis.next_experiment import next_experiment
from diagnosis.result import Claim
from recordings.run import Array

WAYS = 2  # that held-out data are taken: validation runs, and identification stretches in turn
UNKNOWN_LEVEL = 0.03  # of the test between stretches of time, after all surrogates that were tried


def structures(found: Round, noise: Noise) -> tuple[Structure, ...]:
    """What surrogates predict of each joint's residual, friction and offsets fitted that may not be claimed."""
    usual = {number for number, unusual in enumerate(found.solver.unusual) if not unusual}
    state = State(tuple(sorted({*found.state.groups, *usual})), found.state.widths)
    residual = found.residual(found.solver.fit(state))
    return tuple(_surest(found, residual[:, joint], joint, noise) for joint in range(residual.shape[1]))


def _surest(found: Round, residual: Array, joint: int, noise: Noise) -> Structure:
    """What the surest surrogate predicts of a joint's residual (rows,), its p-value that of the best of all."""
    observed = found.bench.observed
    few = families(observed, joint, observed.torque[:, joint] - residual)
    tried = [structure(residual, joint, each, noise, observed) for each in (found.bench.features[joint], *few)]
    best = min(tried, key=lambda each: (each.gain <= SMALL, each.p_value))
    return replace(best, p_value=min(1.0, best.p_value * WAYS * len(tried)))


def structured(each: Structure) -> bool:
    """Whether it is more than chance, and large enough to matter."""
    return each.gain > SMALL and each.p_value < UNKNOWN_LEVEL


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
