"""A mass at the tool that the simulation does not have: one number that explains the motion of several joints.

At one joint a mass looks like another gain, damping and friction. It loads all joints that carry the tool, in shares of
gravity and inertia that follow from its place. With m_j and its variance from the fit of joint j,

    mass = sum_j (m_j / var_j) / sum_j (1 / var_j)

The arm is replayed anew with each mass, because it moves the joints that push each other.

A mass competes with servos that differ from the simulation. Both models are judged on windows that took no part, with
the numbers that are named free and all others as in the simulation. k numbers cost

    sum_j log(mean squared error of joint j) + sum_k price of number k

so that each number has to take as much off the error as one of a servo (`price_of_number`); the mass has the least
price of all joints. The mass alone is tried first, with the servos
of the simulation where it has them, then the mass beside the numbers that were named without it.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.diagnosis.motion.arm_fit import ArmFit, fit_arm, number_of_tests
from armlab.diagnosis.motion.choose import (
    ChosenServo,
    Gain,
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
from armlab.diagnosis.motion.servo import place
from armlab.diagnosis.motion.simulation import ServoSimulation
from armlab.diagnosis.motion.tuning import MotionTuning
from armlab.diagnosis.motion.windows import Windows
from armlab.recordings.recording import MotionRun

MIN_WORK = 1e-9  # N m per kg, or kg m2 per kg: below it a joint does not carry the tool


@dataclass(frozen=True, eq=False)
class JointModel:
    """A joint in windows, with numbers (parameters,) of which some are free."""

    windows: Windows
    values: Array
    free: NDArray[np.bool_]

    def loaded(self, mass: float) -> Array:
        """The numbers with a mass at the tool beside that of the windows, kg."""
        values = self.values.copy()
        values[place("payload")] = mass
        return values


@dataclass(frozen=True, eq=False)
class Payload:
    """A mass at the tool.

    simulation: with the mass; error: its standard error, kg; windows: number of blocks; squares: mean squared error of
    each joint that carries it, rad2, and gain: both on windows that took no part, the gain of errors over the noise.
    """

    simulation: ServoSimulation
    error: float
    windows: int
    squares: dict[int, float]
    gain: Gain


def weigh_tool(
    taken: Callable[[Sequence[Array | None]], Sequence[MotionRun]],
    bare: ArmFit,
    progress: Callable[[str], None],
) -> tuple[ArmFit, Payload] | None:
    """The arm with a mass at the tool; None where servos alone explain the motion as well at less cost.

    taken: as `fit_arm` has it. bare: the fit of the servos alone.
    """
    tuning = bare.tuning
    for models, starts in _hypotheses(bare):
        found = find_payload(replace(bare, starts=starts), models)
        if found is None or not _can_pay(found, bare, tuning):
            continue
        loaded = fit_arm(taken, found.simulation, starts, progress, tuning)
        again = find_payload(loaded, named_models(loaded))
        if again is not None and abs(again.simulation.payload - found.simulation.payload) > again.error:
            loaded = fit_arm(taken, again.simulation, starts, progress, tuning)
            again = find_payload(loaded, named_models(loaded))
        if again is not None and _cost(loaded, bare, tuning) < _cost(bare, loaded, tuning):
            return loaded, again
    return None


def named_models(fit: ArmFit) -> list[JointModel | None]:
    """Each joint with the numbers that are named free, and all others as in the simulation; None without a servo."""
    return [
        None if each is None else JointModel(joint.with_integral(each.fit.integral), *each.named)
        for joint, each in zip(fit.windows, fit.chosen, strict=True)
    ]


def _hypotheses(bare: ArmFit) -> Iterator[tuple[list[JointModel | None], Sequence[Array | None]]]:
    """What may stand beside a mass: the simulation's servos where it has them, and those that were named.

    Each with the numbers with which the arm is replayed.
    """
    nominal = bare.simulation.nominal.values
    named = named_models(bare)
    if all(np.isfinite(row).all() for row, each in zip(nominal, named, strict=True) if each is not None):
        none = np.zeros(nominal.shape[1], dtype=bool)
        alone = [
            None if each is None else JointModel(each.windows, row.copy(), none)
            for row, each in zip(nominal, named, strict=True)
        ]
        yield alone, [None if each is None else each.values for each in alone]
    if any(each is not None and each.free.any() for each in named):
        yield named, bare.starts


def find_payload(fit: ArmFit, models: Sequence[JointModel | None]) -> Payload | None:
    """The mass that explains the motion of all joints better, None without one.

    fit: whose windows are looked at first, and with whose starts the arm is replayed. models: of each joint, in these
    windows.
    """
    simulation, odd, tuning = fit.simulation, _odd_windows(fit.chosen), fit.tuning
    for remaining in reversed(range(tuning.payload_replays)):
        joints = {
            number: JointModel(_sound(each.windows, odd, tuning), each.values, each.free)
            for number, each in enumerate(models)
            if each is not None and _carries_tool(each.windows)
        }
        if not joints:
            return None
        without, with_it = _errors_without_and_with(list(joints.values()), simulation.payload, tuning)
        gain = _gain_of_all(list(joints.values()), without, with_it, tuning)
        if not is_finding(gain, number_of_tests(len(models)), tuning):
            return None
        before = simulation.payload
        more, error = estimate_mass(list(joints.values()), tuning)
        simulation = simulation.with_payload(more)
        if not simulation.is_physical():
            return None
        if abs(more) < 0.5 * error or not remaining:
            break
        windows = coupled_windows(fit.runs, simulation, fit.starts, tuning)
        models = [
            None if each is None else JointModel(joint.with_integral(each.windows.integral), each.values, each.free)
            for joint, each in zip(windows, models, strict=True)
        ]
    if _is_made_by_encoder_steps(list(joints.values()), before, simulation.payload, tuning):
        return None
    squares = {number: float(np.mean(errors**2)) for number, errors in zip(joints, with_it, strict=True)}
    return Payload(simulation, error, joints[next(iter(joints))].windows.count, squares, gain)


def estimate_mass(joints: Sequence[JointModel], tuning: MotionTuning) -> tuple[float, float]:
    """A mass at the tool beside that of the windows, and its standard error, kg; infinite where no joint carries it."""
    weights, masses = [], []
    for joint in (each for each in joints if _carries_tool(each.windows)):
        free = joint.free.copy()
        free[place("payload")] = True
        found = fit_servo(joint.windows, joint.values, free, tuning.refit_evaluations)
        weights.append(1 / max(float(found.standard_errors()[place("payload")]) ** 2, 1e-300))
        masses.append(float(found.values[place("payload")]))
    told = float(np.sum(weights))
    return (float(np.average(masses, weights=weights)), float(1 / np.sqrt(told))) if told > 0 else (0.0, np.inf)


def _errors_without_and_with(
    joints: Sequence[JointModel], mass: float, tuning: MotionTuning
) -> tuple[list[Array], list[Array]]:
    """Errors (samples,) of each joint without a payload and with one, each by numbers learned on the other half, rad.

    mass: of the windows, kg.
    """
    count = joints[0].windows.count
    without, with_it = ([np.zeros(len(joint.windows.position)) for joint in joints] for _ in range(2))
    for first in (0, 1):
        train, test = np.arange(first, count, 2), np.arange(1 - first, count, 2)
        halves = [(joint.windows.select(train), joint.windows.select(test)) for joint in joints]
        learned = [JointModel(half, joint.values, joint.free) for joint, (half, _) in zip(joints, halves, strict=True)]
        more = estimate_mass(learned, tuning)[0]
        for row, (joint, parts) in enumerate(zip(joints, halves, strict=True)):
            judged = np.isin(joint.windows.window, test)
            for errors, load in ((without, -mass), (with_it, more)):
                errors[row][judged] = learned_errors(parts, joint.loaded(load), joint.free, tuning)
    return without, with_it


def _is_made_by_encoder_steps(joints: Sequence[JointModel], mass: float, found: float, tuning: MotionTuning) -> bool:
    """Whether an arm without a mass looks as if it had one because its drives read their encoders in steps.

    mass: of the windows, found: the one in question, kg. The squared error that a mass takes goes with its square.
    """
    counted = []
    for joint in joints:
        fit = fit_servo(joint.windows, joint.loaded(-mass), joint.free, tuning.refit_evaluations)
        counted.append(JointModel(replay_in_steps(joint.windows, fit.values), fit.values, joint.free))
    made = mass + estimate_mass(counted, tuning)[0]
    return made * found > 0 and made**2 > tuning.max_made * found**2


def _gain_of_all(
    joints: Sequence[JointModel], without: Sequence[Array], with_it: Sequence[Array], tuning: MotionTuning
) -> Gain:
    """What a mass is worth over all joints, of errors over those with it. share: at the joint that gains most."""
    gains, noises, scaled = list[Gain](), list[float](), list[tuple[Array, Array]]()
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


def _can_pay(found: Payload, bare: ArmFit, tuning: MotionTuning) -> bool:
    """Whether a mass can cost less than servos alone: a joint that it leaves worse needs one number more at least."""
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


def _cost(fit: ArmFit, other: ArmFit, tuning: MotionTuning) -> float:
    """Cost of a model on the windows that neither of two models calls odd."""
    cost, prices = 0.0, list[float]()
    for model, one, two in zip(named_models(fit), fit.chosen, other.chosen, strict=True):
        if model is not None and two is not None:
            sound = _sound(model.windows, _odd_windows([one, two]), tuning)
            square = _mean_square(JointModel(sound, model.values, model.free), tuning)
            prices.append(price_of_number(square, reading_noise(sound, model.values), tuning))
            cost += float(np.log(square)) + prices[-1] * int(model.free.sum())
    return cost + (min(prices, default=0.0) if fit.simulation.payload else 0.0)


def _mean_square(model: JointModel, tuning: MotionTuning) -> float:
    """Mean squared error, by numbers that were learned on the other half."""
    return max(float(np.mean(errors_on_other_half(model.windows, model.values, model.free, tuning) ** 2)), 1e-300)


def _odd_windows(chosen: Sequence[ChosenServo | None]) -> NDArray[np.intp]:
    """Windows that some servo does not explain."""
    return np.unique(np.concatenate([np.zeros(0, dtype=np.intp), *(each.odd for each in chosen if each is not None)]))


def _sound(windows: Windows, odd: NDArray[np.intp], tuning: MotionTuning) -> Windows:
    kept = np.setdiff1d(np.arange(windows.count), odd)
    return windows.select(kept[evenly_spread(len(kept), tuning.max_judged_windows)])


def _carries_tool(windows: Windows) -> bool:
    return max(float(np.abs(windows.unit_load).max()), float(np.abs(windows.unit_inertia).max())) > MIN_WORK
