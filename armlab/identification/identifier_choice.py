"""Which model is identified: the one that can exist, unless another predicts better than chance has it.

Blocks of the runs that identify are left out in turn, and what each model leaves of their torque is compared, block by
block. Models are physically consistent, or fitted by least squares: with every direction, without those that the motion
hardly excites, and drawn to the links of the robot file from afar. Each is tried with Coulomb friction that follows the
sign of the velocity, and with friction that turns smoothly: a joint that rests has the sign of its encoder's noise. The
consistent model is taken where its errors are larger than those of the best by no more than one standard error over the
blocks (Breiman, Friedman, Olshen and Stone 1984), or by no more than a percent.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.identification.components import usual_components
from armlab.identification.identifier import METHODS, Identifier, fastest_speeds
from armlab.identification.priors import Pull
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.cutoff_trial import HeldOutBlocks
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion

WIDE_TOLERANCE = 10.0  # of a prior about the robot file's links: bodies may be so many times as large
MIN_GAIN = 0.01  # of the mean logarithm of the joints' errors: less is no reason to give up consistency
CONSISTENT = "physical"  # the method whose bodies can exist


@dataclass(frozen=True, eq=False)
class IdentifierChoice:
    """An identifier that is not fitted yet, and why it was chosen.

    cost: by how much the errors of the best consistent model are larger on the blocks, a share; None where there is
    none. stopped: why no consistent model was found.
    """

    identifier: Identifier
    cost: float | None
    stopped: str = ""

    @property
    def sentence(self) -> str:
        """What is delivered and why, in a line."""
        manner = self.identifier.manner
        if self.identifier.method == CONSISTENT:
            return f"{manner}: on blocks of the runs that identify, none predicts better by more than chance or 1 %"
        if self.cost is None:
            best = f"{manner}, which predicts best on blocks of the runs that identify"
            return f"{best}; no physically consistent model was compared: {self.stopped}"
        return (
            f"{manner}, which predicts best on blocks of the runs that identify; there a physically consistent model "
            f"errs {100 * self.cost:.0f} % more (--method {CONSISTENT})"
        )


def choose_identifier(arm: Arm, runs: Sequence[Run], cutoff_hz: float, robot: str) -> IdentifierChoice:
    """The best identifier of an arm by blocks of runs that are left out in turn.

    robot: the robot file, as in `Identifier`. Raises ValueError for runs that do not fit the arm.
    """
    held_out = HeldOutBlocks.of(runs).up_to(cutoff_hz)
    stopped = list[str]()
    scored = list(_scored(arm, held_out, cutoff_hz, robot, stopped))
    best, best_scores = min(scored, key=lambda each: float(np.mean(each[1])))
    consistent = [each for each in scored if each[0].method == CONSISTENT]
    if not consistent:
        return IdentifierChoice(best, None, stopped[0])
    chosen, scores = min(consistent, key=lambda each: float(np.mean(each[1])))
    beyond = scores - best_scores
    within = np.mean(beyond) <= max(np.std(beyond, ddof=1) / np.sqrt(len(beyond)), MIN_GAIN)
    return IdentifierChoice(chosen if within else best, float(np.exp(np.mean(beyond)) - 1))


def _scored(
    arm: Arm, held_out: HeldOutBlocks, cutoff_hz: float, robot: str, stopped: list[str]
) -> Iterator[tuple[Identifier, Array]]:
    """Identifiers with their scores on each block, (blocks,). stopped: takes what stopped the others."""
    usual = Identifier(arm, usual_components(arm), cutoff_hz=cutoff_hz, robot=robot)
    top_speed = fastest_speeds(usual.prepare(held_out.runs)[1])
    for friction in (usual.components, usual_components(arm, top_speed)):
        free = replace(usual, components=friction)
        alike = [free, replace(free, method="excited"), replace(free, method=CONSISTENT)]
        yield from _scored_alike(alike, held_out, stopped)
        if arm.links is not None:
            yield from _scored_alike([replace(free, pull=Pull("nominal", WIDE_TOLERANCE))], held_out, stopped)


def _scored_alike(
    identifiers: Sequence[Identifier], held_out: HeldOutBlocks, stopped: list[str]
) -> Iterator[tuple[Identifier, Array]]:
    """Scores of identifiers of the same columns; a solver or a missing package may stop that of consistent bodies."""
    fitted = identifiers[0].prepare(held_out.runs)
    structure, signals, data = fitted
    block = np.concatenate([own[each.filter.rows] for own, each in zip(held_out.blocks, signals, strict=True)])
    for each in identifiers:
        estimator = METHODS[each.method](fitted, each.pull)
        try:
            values = {number: estimator(data.rows(block != number)).values for number in held_out.numbers}
        except (InputError, RuntimeError) as error:
            if each.method != CONSISTENT:
                raise
            stopped.append(str(error))
            continue
        models = {number: TorqueModel("", structure, own) for number, own in values.items()}

        def predict(number: int, place: int, part: slice, models: dict[int, TorqueModel] = models) -> Array:
            motion = signals[place].motion
            own = Motion(motion.position[part], motion.velocity[part], motion.acceleration[part])
            return models[number].torque(own, signals[place].run.rows(part))

        yield each, held_out.scores(predict)
