"""Held-out runs judge the numbers of servos: replays of each joint alone and of the whole arm, before and after."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.motion.choose import ChosenServo
from armlab.diagnosis.motion.estimate import rms_of, settle
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ReplayError, ServoFinding
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.replay import Replayed, joint_rms, replay
from armlab.diagnosis.motion.servo import Servos, place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.shared_number import (
    TOOL_MASS,
    with_more,
)
from armlab.diagnosis.motion.windows import Windows, smallest_step, window_stretches
from armlab.recordings.recording import MotionRun

EXACT_STEPS = 4  # of a replay that judges, within one of the simulation


@dataclass(frozen=True)
class JointTrials:
    """What is tried of one joint (from 0) whose replay in the simulator is worse with the numbers found.

    is_confirmed: whether the joint alone, in armlab's own replay of whole held-out runs, is clearly better with them
    than with those of the simulation. with_one_finding: its servo with one finding and nothing else, and what is named
    then.
    """

    is_confirmed: Callable[[int, Array], bool]
    with_one_finding: Callable[[int, ServoFinding, ChosenServo], tuple[ChosenServo, list[ServoFinding]]]


def replay_named(
    simulations: tuple[ServoSimulation, ServoSimulation],
    chosen: Sequence[ChosenServo | None],
    named: Sequence[list[ServoFinding]],
    trials: JointTrials,
    before: tuple[Replayed, ...],
    held_out: Sequence[MotionRun],
    tuning: MotionTuning = DEFAULT,
) -> tuple[list[ChosenServo | None], list[list[ServoFinding]], Servos, tuple[Replayed, ...]]:
    """The servos and the names of each joint that hold in held-out runs, all numbers, and their replay.

    A joint whose replay is worse with its numbers, the worst first, gets back those of the simulation. Where it has a
    single finding, that one is tried alone before: other numbers, which are none, may spoil the replay. A whole run of
    sticking joints goes a little another way with any other number: worse is what matters and exceeds the standard
    error over stretches, also with steps so short that the simulator's own error is small. Where the simulation as it
    is given ends at the encoder's steps, its own error is small enough. Elsewhere a joint keeps numbers that its own
    replay confirms, because the simulator lets joints creep that stick.
    simulations: as it is given, and with a payload that was found. before: replay of the first one.
    """
    chosen, named, (given, simulation) = list(chosen), list(named), simulations
    sound, tried_alone = set[int](), set[int]()
    exact_before: list[Replayed] = []
    while True:
        values = [_values_after(simulation, number, each, bool(named[number])) for number, each in enumerate(chosen)]
        servos = Servos(np.stack(values))
        after = tuple(replay(simulation, servos, held_out))
        rises = _rises(before, after, tuning) if before else np.zeros(len(named))
        judged = [bool(own) and number not in sound for number, own in enumerate(named)]
        rises = np.where(judged, rises, 0.0)
        worst = int(np.argmax(rises))
        if rises[worst] <= 1:
            return chosen, named, servos, after
        trusted = _is_at_floor(before, worst, tuning)
        if not trusted and trials.is_confirmed(worst, values[worst]):
            sound.add(worst)
            continue
        exact_before = exact_before or replay(given, None, held_out, EXACT_STEPS)
        exact_after = replay(simulation, servos, held_out, EXACT_STEPS)
        own = chosen[worst]
        if not trusted and _rises(exact_before, exact_after, tuning)[worst] <= 1:
            sound.add(worst)
        elif own is None or worst in tried_alone or len(named[worst]) != 1:
            named[worst] = []
        else:
            chosen[worst], named[worst] = trials.with_one_finding(worst, named[worst][0], own)
            tried_alone.add(worst)


def _is_at_floor(replayed: Sequence[Replayed], joint: int, tuning: MotionTuning) -> bool:
    """Whether a replay of whole runs misses a joint's position by the steps of its encoder alone; joint: from 0."""
    step = smallest_step(np.concatenate([each.run.position[:, joint] for each in replayed]))
    return bool(joint_rms(replayed)[joint] < tuning.same_error * step / np.sqrt(12))


def _rises(before: Sequence[Replayed], after: Sequence[Replayed], tuning: MotionTuning) -> Array:
    """How much the squared error of each joint rises, (joints,), as `rise_of` has it, over stretches of the runs."""
    without, with_it = _stretches_of_replays(before, after, tuning)
    return np.array([rise_of(*pair, tuning) for pair in zip(without.T, with_it.T, strict=True)])


def _stretches_of_replays(
    before: Sequence[Replayed], after: Sequence[Replayed], tuning: MotionTuning
) -> tuple[Array, Array]:
    """Squared errors of two replays of the same runs, (stretches, joints) each."""
    starts = [(name, first) for name, first, _ in window_stretches([each.run for each in before], tuning)]
    squares: tuple[list[Array], list[Array]] = [], []
    for pair in zip(before, after, strict=True):
        edges = np.searchsorted(pair[0].run.time, [first for name, first in starts if name == pair[0].run.name])
        for each, replayed in zip(squares, pair, strict=True):
            each.append(np.add.reduceat(replayed.error**2, edges))
    return np.concatenate(squares[0]), np.concatenate(squares[1])


def rise_of(without: Array, with_it: Array, tuning: MotionTuning) -> float:
    """How much the squared error of stretches, (stretches,), rises, in standard errors; 0 for little."""
    if np.sum(with_it) * (1 - tuning.min_gain) <= np.sum(without):
        return 0.0
    rises = with_it - without
    error = float(np.std(rises, ddof=1)) / np.sqrt(len(rises)) if len(rises) > 1 else 0.0
    return float(np.mean(rises) / max(error, 1e-300))


def _values_after(simulation: ServoSimulation, number: int, chosen: ChosenServo | None, named: bool) -> Array:
    """Numbers of a joint for the simulation after: those of the simulation where nothing better is known.

    named: whether one of the fitted ones is a finding.
    """
    nominal = simulation.nominal.values[number]
    if chosen is not None and (named or not np.isfinite(nominal).all()):
        return chosen.beside_kd(float(nominal[place("kd")]))
    if not np.isfinite(nominal).all():
        joint, name = simulation.number_of(number), simulation.arm.joints[simulation.joints[number]].name
        raise InputError(
            f"joint {joint} ({name}) shows nothing of its drive, and neither the robot's file nor `controller` "
            "tells its gain: leave it out by `joints`, or give `controller.kp` and `torque_limit`"
        )
    return np.asarray(nominal)


def replays_as_well(shared: MotionDiagnosis, bare: MotionDiagnosis, tuning: MotionTuning) -> bool:
    """Whether held-out runs replay with a shared number not clearly worse, over all joints, than without it.

    Many numbers of servos fit the simulator's own error, too, which one shared number cannot: worse is what is worse
    also with steps so short that this error is small, unless each joint alone, whose replay sticks exactly, replays
    clearly better with it, and the simulator does not end at the encoder's steps without it.
    """
    if shared.servos is None or bare.servos is None:
        return bare.servos is None
    whole = _stretches_of_replays(bare.replayed_after, shared.replayed_after, tuning)
    if not _is_clearly_worse(*whole, tuning):
        return True
    trusted = all(_is_at_floor(bare.replayed_after, joint, tuning) for joint in range(len(bare.chosen)))
    if not trusted and _is_clearly_worse(shared.replayed_alone, bare.replayed_alone, tuning):
        return True
    without, with_it = (
        replay(each.simulation, each.servos, [own.run for own in each.replayed_after], EXACT_STEPS)
        for each in (bare, shared)
    )
    return not _is_clearly_worse(*_stretches_of_replays(without, with_it, tuning), tuning)


def _is_clearly_worse(without: Array, with_it: Array, tuning: MotionTuning) -> bool:
    """Whether the squared errors (stretches, joints) of all joints together rise, each as a share of its mean."""
    size = np.maximum(without.mean(axis=0), 1e-300)
    return rise_of((without / size).sum(axis=1), (with_it / size).sum(axis=1), tuning) > tuning.clearly_worse


def stretch_squares(windows: Windows, values: Array, tuning: MotionTuning) -> Array:
    """Squared error of a replay over stretches of the runs, as many as there are windows of a recording."""
    parts = np.array_split(settled_errors(windows, values) ** 2, tuning.wanted_windows)
    return np.array([float(part.sum()) for part in parts])


def settled_errors(windows: Windows, values: Array) -> Array:
    """Errors (samples,) of a replay whose drive's integral at the start of each run fits best, rad."""
    return np.asarray(joint_errors(settle(windows, values), values)[0])


def command_error(windows: Windows) -> Array:
    """Command minus position at the samples, rad: the error of a servo that follows without any error."""
    command = windows.command[windows.window, windows.history + windows.row]
    return np.asarray(command - windows.position)


def errors_of_joint(
    number: int,
    simulations: tuple[ServoSimulation, ServoSimulation],
    servos: Servos,
    judged: Windows,
    before: Sequence[Replayed],
    after: Sequence[Replayed],
    held_out: Sequence[MotionRun],
) -> ReplayError:
    given, simulation = simulations
    nominal = given.nominal.values[number]
    known = bool(np.isfinite(nominal).all())
    commands = np.concatenate(
        [np.asarray(run.reference_position)[:, number] - run.position[:, number] for run in held_out]
    )
    return ReplayError(
        joint=given.number_of(number),
        before=rms_of(settled_errors(judged, with_more(nominal, TOOL_MASS.place, -simulation.payload)))
        if known
        else None,
        after=rms_of(settled_errors(judged, servos.values[number])),
        replay_before=float(joint_rms(before)[number]) if before else None,
        replay_after=float(joint_rms(after)[number]),
        command=rms_of(commands),
        spread=float(np.std(np.concatenate([run.position[:, number] for run in held_out]))),
        floor=judged.encoder_noise,
    )
