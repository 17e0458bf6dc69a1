"""Numbers that all joints share: a mass at the tool, and a delay of all commands.

At one joint a mass looks like another gain, damping and friction, and a delay like another damping and inertia. One
number that explains the motion of several joints does not. A mass loads all joints that carry the tool, in shares of
gravity and inertia that follow from its place; a delay is alike at all of them. With x_j and its variance from the fit
of joint j,

    x = sum_j (x_j / var_j) / sum_j (1 / var_j)

The arm is replayed anew with each number, because it changes the motion of the joints that push each other.

A shared number competes with servos that differ from the simulation. Both models are judged on windows that took no
part, with the numbers that are named free and all others as in the simulation. k numbers cost

    sum_j log(mean squared error of joint j) + sum_k price of number k

so that each number has to take as much off the error as one of a servo (`price_of_number`); a shared one has the least
price of all joints. It is tried alone first, with the servos of the simulation where it has them, then beside the
numbers that were named without it.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.arm_fit import ArmFit, fit_arm, number_of_tests
from armlab.diagnosis.motion.choose import (
    ChosenServo,
    GainOfNumber,
    chance_of_gain,
    chance_of_match,
    errors_on_other_half,
    gain_of,
    is_finding,
    learned_errors,
    window_squares,
)
from armlab.diagnosis.motion.couple import coupled_windows
from armlab.diagnosis.motion.encoder_steps import replay_in_steps
from armlab.diagnosis.motion.estimate import evenly_spread, fit_servo, price_of_number, reading_noise
from armlab.diagnosis.motion.motion_tuning import MotionTuning
from armlab.diagnosis.motion.servo import place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.windows import Windows
from armlab.recordings.recording import MotionRun

MIN_WORK = 1e-9  # N m per kg, or kg m2 per kg: below it a joint does not carry the tool


@dataclass(frozen=True, eq=False)
class JointModel:
    """A joint in windows, with numbers (parameters,) of which some are free."""

    windows: Windows
    values: Array
    free: NDArray[np.bool_]

    def with_more(self, number: int, more: float) -> "JointModel":
        """The same with more of a number, by its place in PARAMETERS."""
        return replace(self, values=with_more(self.values, number, more))


def with_more(values: Array, number: int, more: float) -> Array:
    """Numbers (parameters,) with more of one of them, by its place in PARAMETERS."""
    changed = values.copy()
    changed[number] += more
    return changed


class SharedNumber(ABC):
    """A number of the whole arm. key: of its parameter. doing: what is being done while it is weighed."""

    key: Literal["payload", "delay"]
    doing: str

    @property
    def place(self) -> int:
        """Of its parameter."""
        return place(self.key)

    @abstractmethod
    def amount(self, simulation: ServoSimulation) -> float:
        """What a simulation has of it beyond the one that is given."""

    @abstractmethod
    def added(self, simulation: ServoSimulation, more: float) -> ServoSimulation:
        """A simulation with more of it."""

    @abstractmethod
    def is_felt(self, windows: Windows) -> bool:
        """Whether a joint shows it."""

    @abstractmethod
    def moved(self, values: Array, more: float) -> Array:
        """Numbers of a joint, (parameters,), for a replay of an arm that has more of it."""

    @abstractmethod
    def without_own(self, values: Array, nominal: Array) -> Array:
        """Numbers of a joint with none of its own in place of it. values, nominal: (parameters,)."""


class ToolMass(SharedNumber):
    """A mass at the tool, kg: in the loads and inertias of all joints that carry it, and no number of their servos."""

    key = "payload"
    doing = "weighing the tool"

    def amount(self, simulation: ServoSimulation) -> float:
        return simulation.payload

    def added(self, simulation: ServoSimulation, more: float) -> ServoSimulation:
        return simulation.with_payload(more)

    def is_felt(self, windows: Windows) -> bool:
        return max(float(np.abs(windows.unit_load).max()), float(np.abs(windows.unit_inertia).max())) > MIN_WORK

    def moved(self, values: Array, more: float) -> Array:
        return values

    def without_own(self, values: Array, nominal: Array) -> Array:
        return values


class CommonDelay(SharedNumber):
    """A delay of the commands of all joints, s: of the bus or the computer that sends them."""

    key = "delay"
    doing = "timing the commands of all joints"

    def amount(self, simulation: ServoSimulation) -> float:
        return simulation.delay

    def added(self, simulation: ServoSimulation, more: float) -> ServoSimulation:
        return simulation.with_delay(more)

    def is_felt(self, windows: Windows) -> bool:
        return True

    def moved(self, values: Array, more: float) -> Array:
        return with_more(values, self.place, more)

    def without_own(self, values: Array, nominal: Array) -> Array:
        return with_more(values, self.place, float(nominal[self.place] - values[self.place]))


TOOL_MASS, COMMON_DELAY = ToolMass(), CommonDelay()


@dataclass(frozen=True, eq=False)
class FoundNumber:
    """A number that all joints share, and that differs from the simulation's.

    simulation: with it; error: its standard error; windows: number of blocks; squares: mean squared error of each joint
    that shows it, rad2, and gain: both on windows that took no part, the gain of errors over the noise.
    """

    number: SharedNumber
    simulation: ServoSimulation
    error: float
    windows: int
    squares: dict[int, float]
    gain: GainOfNumber


def weigh(
    number: SharedNumber,
    taken: Callable[[Sequence[Array | None]], Sequence[MotionRun]],
    bare: ArmFit,
    progress: Callable[[str], None],
) -> tuple[ArmFit, FoundNumber] | None:
    """The arm with a shared number; None where servos alone explain the motion as well at less cost.

    Nor is anything gained where each joint has a number of its own in place of it.
    taken: as `fit_arm` has it. bare: the fit of the servos alone.
    """
    tuning = bare.tuning
    if all(each.free[number.place] for each in named_models(bare) if each is not None):
        return None
    for models, starts in _hypotheses(number, bare):
        found = find_shared(number, replace(bare, starts=starts), models)
        if found is None or not _can_pay(found, bare, tuning):
            continue
        fit = _fit_with(found, bare, taken, starts, progress)
        again = find_shared(number, fit, _without_own(number, fit))
        if again is not None and abs(_more(again, found.simulation)) > again.error:
            fit = _fit_with(again, fit, taken, fit.starts, progress)
            again = find_shared(number, fit, _without_own(number, fit))
        if again is not None and cost_of(fit, bare) < cost_of(bare, fit):
            return fit, again
    return None


def _fit_with(
    found: FoundNumber,
    before: ArmFit,
    taken: Callable[[Sequence[Array | None]], Sequence[MotionRun]],
    starts: Sequence[Array | None],
    progress: Callable[[str], None],
) -> ArmFit:
    """The servos of all joints beside a shared number. before: without it; starts: as it was replayed."""
    more = _more(found, before.simulation)
    moved = [None if each is None else found.number.moved(each, more) for each in starts]
    return fit_arm(taken, found.simulation, moved, progress, before.tuning)


def _more(found: FoundNumber, simulation: ServoSimulation) -> float:
    return found.number.amount(found.simulation) - found.number.amount(simulation)


def named_models(fit: ArmFit) -> list[JointModel | None]:
    """Each joint with the numbers that are named free, and all others as in the simulation; None without a servo."""
    return [
        None if each is None else JointModel(joint.with_integral(each.fit.integral), *each.named)
        for joint, each in zip(fit.windows, fit.chosen, strict=True)
    ]


def _without_own(number: SharedNumber, fit: ArmFit) -> list[JointModel | None]:
    """The named models with no number of a joint's own in place of the shared one."""
    models = list[JointModel | None]()
    for each, nominal in zip(named_models(fit), fit.simulation.nominal.values, strict=True):
        if each is not None:
            free = each.free.copy()
            free[number.place] = False
            each = replace(each, values=number.without_own(each.values, nominal), free=free)
        models.append(each)
    return models


def _hypotheses(number: SharedNumber, bare: ArmFit) -> Iterator[tuple[list[JointModel | None], Sequence[Array | None]]]:
    """What may stand beside a shared number: the simulation's servos where it has them, and those that were named.

    Each with the numbers with which the arm is replayed.
    """
    nominal = bare.simulation.nominal.values
    named = _without_own(number, bare)
    if all(np.isfinite(row).all() for row, each in zip(nominal, named, strict=True) if each is not None):
        none = np.zeros(nominal.shape[1], dtype=bool)
        alone = [
            None if each is None else JointModel(each.windows, row.copy(), none)
            for row, each in zip(nominal, named, strict=True)
        ]
        yield alone, [None if each is None else each.values for each in alone]
    if any(each is not None and each.free.any() for each in named):
        yield (
            named,
            [
                None if start is None else number.without_own(start, row)
                for start, row in zip(bare.starts, nominal, strict=True)
            ],
        )


def find_shared(number: SharedNumber, fit: ArmFit, models: Sequence[JointModel | None]) -> FoundNumber | None:
    """The shared number that explains the motion of all joints better, None without one.

    fit: whose windows are looked at first, and with whose starts the arm is replayed. models: of each joint, in these
    windows.
    """
    simulation, starts, tuning = fit.simulation, fit.starts, fit.tuning
    odd = _odd_windows(fit.chosen)
    for remaining in reversed(range(tuning.coupling_rounds)):
        joints = {
            at: JointModel(_sound(each.windows, odd, tuning), each.values, each.free)
            for at, each in enumerate(models)
            if each is not None and number.is_felt(each.windows)
        }
        if not joints:
            return None
        before = number.amount(simulation)
        without, with_it = _errors_without_and_with(number, list(joints.values()), before, tuning)
        gain = _gain_of_all(list(joints.values()), without, with_it, tuning)
        if not is_finding(gain, number_of_tests(len(models)), tuning):
            return None
        more, error = estimate_shared(number, list(joints.values()), tuning)
        simulation = number.added(simulation, more)
        if not simulation.is_physical():
            return None
        if abs(more) < 0.5 * error or not remaining:
            break
        starts = [None if each is None else number.moved(each, more) for each in starts]
        windows = coupled_windows(fit.runs, simulation, starts, tuning)
        models = [
            None
            if each is None
            else JointModel(joint.with_integral(each.windows.integral), number.moved(each.values, more), each.free)
            for joint, each in zip(windows, models, strict=True)
        ]
    if _is_made_by_encoder_steps(number, list(joints.values()), before, number.amount(simulation), tuning):
        return None
    squares = {at: float(np.mean(errors**2)) for at, errors in zip(joints, with_it, strict=True)}
    return FoundNumber(number, simulation, error, joints[next(iter(joints))].windows.count, squares, gain)


def estimate_shared(number: SharedNumber, joints: Sequence[JointModel], tuning: MotionTuning) -> tuple[float, float]:
    """What joints tell of a number that all share, beyond what their models have, and its standard error.

    The error is infinite where no joint shows it. It is larger by as much as the joints differ from each other beyond
    their own errors (Birge 1932).
    """
    weights, found = [], []
    for joint in (each for each in joints if number.is_felt(each.windows)):
        free = joint.free.copy()
        free[number.place] = True
        fitted = fit_servo(joint.windows, joint.values, free, tuning.refit_evaluations)
        weights.append(1 / max(float(fitted.standard_errors()[number.place]) ** 2, 1e-300))
        found.append(float(fitted.values[number.place] - joint.values[number.place]))
    told = float(np.sum(weights))
    if told == 0:
        return 0.0, np.inf
    mean = float(np.average(found, weights=weights))
    scatter = float(np.sum(np.array(weights) * (np.array(found) - mean) ** 2)) / max(len(found) - 1, 1)
    return mean, float(np.sqrt(max(scatter, 1.0) / told))


def _errors_without_and_with(
    number: SharedNumber, joints: Sequence[JointModel], amount: float, tuning: MotionTuning
) -> tuple[list[Array], list[Array]]:
    """Errors (samples,) of each joint without and with a shared number, each by what the other half tells, rad.

    amount: what the models have of it beyond the simulation that is given.
    """
    count = joints[0].windows.count
    without, with_it = ([np.zeros(len(joint.windows.position)) for joint in joints] for _ in range(2))
    for first in (0, 1):
        train, test = np.arange(first, count, 2), np.arange(1 - first, count, 2)
        halves = [(joint.windows.select(train), joint.windows.select(test)) for joint in joints]
        learned = [JointModel(half, joint.values, joint.free) for joint, (half, _) in zip(joints, halves, strict=True)]
        more = estimate_shared(number, learned, tuning)[0]
        for row, (joint, parts) in enumerate(zip(joints, halves, strict=True)):
            judged = np.isin(joint.windows.window, test)
            for errors, change in ((without, -amount), (with_it, more)):
                changed = with_more(joint.values, number.place, change)
                errors[row][judged] = learned_errors(parts, changed, joint.free, tuning)
    return without, with_it


def _is_made_by_encoder_steps(
    number: SharedNumber, joints: Sequence[JointModel], amount: float, found: float, tuning: MotionTuning
) -> bool:
    """Whether an arm without a shared number looks as if it had one because its drives read their encoders in steps.

    amount: what the models have of it, found: the one in question. The squared error that it takes goes with its
    square.
    """
    counted = []
    for joint in joints:
        bare = with_more(joint.values, number.place, -amount)
        fit = fit_servo(joint.windows, bare, joint.free, tuning.refit_evaluations)
        counted.append(JointModel(replay_in_steps(joint.windows, fit.values), fit.values, joint.free))
    made = estimate_shared(number, counted, tuning)[0]
    return made * found > 0 and made**2 > tuning.max_share_of_encoder_steps * found**2


def _gain_of_all(
    joints: Sequence[JointModel], without: Sequence[Array], with_it: Sequence[Array], tuning: MotionTuning
) -> GainOfNumber:
    """What a number is worth over all joints, of errors over those with it. share: at the joint that gains most."""
    gains, noises, scaled = list[GainOfNumber](), list[float](), list[tuple[Array, Array]]()
    for joint, one, two in zip(joints, without, with_it, strict=True):
        noises.append(reading_noise(joint.windows, joint.values))
        gains.append(gain_of(joint.windows, one, two, noises[-1], tuning))
        size = max(gains[-1].rms_with, 1e-300)
        scaled.append((one / size, two / size))
    squares = [
        sum(window_squares(joint.windows, pair[which]) for joint, pair in zip(joints, scaled, strict=True))
        for which in (0, 1)
    ]
    ranks = chance_of_gain(np.asarray(squares[0] - squares[1]))
    count = joints[0].windows.count
    window = np.concatenate([number * count + joint.windows.window for number, joint in enumerate(joints)])
    noise = [own / max(gain.rms_with, 1e-300) for own, gain in zip(noises, gains, strict=True)]
    before, after = (np.concatenate([pair[which] for pair in scaled]) for which in (0, 1))
    match = chance_of_match(window, before, after, float(np.sqrt(np.mean(np.square(noise)))))
    best = max(gains, key=lambda gain: gain.share / gain.enough)
    return replace(best, p_value=min(ranks, match))


def _can_pay(found: FoundNumber, bare: ArmFit, tuning: MotionTuning) -> bool:
    """Whether it can cost less than servos alone: a joint that it leaves worse needs one number more at least."""
    odd, prices = _odd_windows(bare.chosen), list[float]()
    least, spent = 0.0, 0.0
    for number, model in enumerate(named_models(bare)):
        if number in found.squares and model is not None:
            own = _mean_square(JointModel(_sound(model.windows, odd, tuning), model.values, model.free), tuning)
            left = found.squares[number]
            prices.append(price_of_number(own, reading_noise(model.windows, model.values), tuning))
            least += np.log(min(left, own)) + (prices[-1] if np.log(left / own) > prices[-1] else 0.0)
            spent += np.log(own) + prices[-1] * int(model.free.sum())
    return bool(least + min(prices, default=0.0) < spent)


def cost_of(fit: ArmFit, other: ArmFit) -> float:
    """Cost of a model on the windows that neither of two models calls odd."""
    tuning, cost, prices = fit.tuning, 0.0, list[float]()
    for model, one, two in zip(named_models(fit), fit.chosen, other.chosen, strict=True):
        if model is not None and two is not None:
            sound = _sound(model.windows, _odd_windows([one, two]), tuning)
            square = _mean_square(JointModel(sound, model.values, model.free), tuning)
            prices.append(price_of_number(square, reading_noise(sound, model.values), tuning))
            cost += float(np.log(square)) + prices[-1] * int(model.free.sum())
    shared = sum(bool(number.amount(fit.simulation)) for number in (TOOL_MASS, COMMON_DELAY))
    return cost + min(prices, default=0.0) * shared


def _mean_square(model: JointModel, tuning: MotionTuning) -> float:
    """Mean squared error, by numbers that were learned on the other half."""
    return max(float(np.mean(errors_on_other_half(model.windows, model.values, model.free, tuning) ** 2)), 1e-300)


def _odd_windows(chosen: Sequence[ChosenServo | None]) -> NDArray[np.intp]:
    """Windows that some servo does not explain."""
    return np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *(each.odd for each in chosen if each is not None)]))


def _sound(windows: Windows, odd: NDArray[np.intp], tuning: MotionTuning) -> Windows:
    kept = np.setdiff1d(np.arange(windows.count), odd)
    return windows.select(kept[evenly_spread(len(kept), tuning.max_judged_windows)])
