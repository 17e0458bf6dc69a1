"""The diagnosis of a recording of motion only, step by step.

`diagnose_motion` is the whole flow: check that positions answer their commands, cut the runs into windows, choose and
fit the servo of each joint (`choose_servo`), name what differs from the simulation (`name_differences`), and send the
commands of the held-out runs through the simulation before and after (`replay`).
"""

import time
from collections.abc import Callable, Iterator, Sequence, Set
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.motion.arm_fit import ArmFit, fit_arm, number_of_tests
from armlab.diagnosis.motion.choose import TESTS_OF_GAIN, ChosenServo, Gain, first_fit, judge_again
from armlab.diagnosis.motion.couple import coupled_windows
from armlab.diagnosis.motion.estimate import settle, thin_windows
from armlab.diagnosis.motion.hold import hold_commands, holds_samples
from armlab.diagnosis.motion.joint_replay import joint_errors
from armlab.diagnosis.motion.replay import Replayed, joint_rms, replay
from armlab.diagnosis.motion.separate import TORQUE_SCALED, confused_parameters, has_weak_load
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, KEYS, OPTIONAL, PARAMETERS, ServoParameter, Servos, place
from armlab.diagnosis.motion.shared_number import (
    COMMON_DELAY,
    TOOL_MASS,
    FoundNumber,
    JointModel,
    cost_of,
    estimate_shared,
    weigh,
    with_more,
)
from armlab.diagnosis.motion.simulation import ServoSimulation, read_servo_simulation
from armlab.diagnosis.motion.tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.windows import Windows, make_windows, smallest_step, window_stretches
from armlab.diagnosis.motion.witness import CurrentWitness, correlate_currents
from armlab.recordings.motion import MotionRecording
from armlab.recordings.motion_check import MIN_MOVED, check_answers
from armlab.recordings.recording import MotionRun

EXACT_STEPS = 4  # of a replay that judges, within one of the simulation
NO_SERVO = "no joint follows its command as a position servo does: check the columns, or the controller is another"
Status = Literal["mismatch", "none", "inconclusive"]


@dataclass(frozen=True)
class ServoFinding:
    """One number of a servo that differs from the simulation's.

    joint: from 1. nominal: of the simulation, NaN where it has none. before, after: error of the joint's replay on
    held-out windows with the number of the simulation and with this one, rad. rivals: other effects at this joint.
    """

    parameter: ServoParameter
    effect: str
    name: str
    joint: int
    value: float
    interval: tuple[float, float]
    nominal: float
    before: float
    after: float
    p_value: float
    rivals: tuple[str, ...]

    def is_shorter(self, sample: float) -> bool:
        """Whether it is a delay or a late reading within one sample, s, which the clock of a drive that holds makes."""
        return self.parameter.key == "delay" and abs(abs(self.value) - abs(self.nominal)) < sample

    def is_lead_of(self, step: float) -> bool:
        """Whether it may be a lead of half a step, s, of a simulator, whose integration makes that."""
        return self.effect == "channel_skew" and self.value > 0 and self.interval[0] < step / 2

    @property
    def holds_nominal(self) -> bool:
        """Whether the interval holds the simulation's number."""
        return self.interval[0] <= self.nominal <= self.interval[1]

    @property
    def equation(self) -> str:
        """The law with its number."""
        return self.parameter.equation.format(joint=self.joint, value=f"{self.value:.4g}")


@dataclass(frozen=True)
class JointError:
    """Errors of one joint on held-out data, rad (m).

    before, after: of its replay in windows; replay_before, replay_after: of the whole arm over whole runs; None where
    the simulation has no controller. command: of the command itself, taken as the position. spread: of the position
    about its mean. floor: of the encoder.
    """

    joint: int
    before: float | None
    after: float
    replay_before: float | None
    replay_after: float
    command: float
    spread: float
    floor: float

    def follows_command(self, tuning: MotionTuning = DEFAULT) -> bool:
        """Whether the replay tells more than the command alone, or the mean of the position."""
        return self.replay_after < max(
            tuning.max_unexplained * min(self.command, self.spread), tuning.at_floor * self.floor
        )


@dataclass(frozen=True, eq=False)
class MotionDiagnosis:
    """What a recording of motion only tells. Without an answer only status and summary are set.

    chosen: of each joint, None for one that stands still or follows no servo. servos: all numbers for the simulation
    after. odd: stretches that a servo does not explain: run, from, to. replayed_before, replayed_after: the
    held-out runs. replayed_alone: squared errors after, of each joint alone, (stretches, joints), rad2. tool: error of
    the tool before and after, m. currents: what those of the held-out runs say.
    """

    recording: MotionRecording
    simulation: ServoSimulation
    status: Status
    reason: str = ""
    chosen: tuple[ChosenServo | None, ...] = ()
    servos: Servos | None = None
    findings: tuple[ServoFinding, ...] = ()
    errors: tuple[JointError, ...] = ()
    odd: tuple[tuple[str, float, float], ...] = ()
    replayed_before: tuple[Replayed, ...] = ()
    replayed_after: tuple[Replayed, ...] = ()
    replayed_alone: Array = field(default_factory=lambda: np.zeros((0, 0)))
    tool: tuple[float | None, float] = (None, 0.0)
    silent: tuple[int, ...] = ()
    currents: tuple[CurrentWitness, ...] = ()
    seconds: float = 0.0


def diagnose_motion(
    recording: MotionRecording,
    progress: Callable[[str], None] = lambda message: None,
    tuning: MotionTuning = DEFAULT,
) -> MotionDiagnosis:
    """Which numbers of its servos the simulation of a recording gets wrong, and how much better it replays with others.

    progress: is told what is being done. Raises InputError where the simulation cannot be used.
    """
    started = time.perf_counter()
    simulation = given = read_servo_simulation(recording)
    reason = reason_unusable(recording)
    if reason is not None:
        return MotionDiagnosis(recording, simulation, "inconclusive", reason)
    learned, held_out = split_runs(recording, tuning.held_out_share)
    progress("fitting each joint alone")
    firsts = _first_fits(learned, simulation, tuning)
    held = holds_samples(recording.runs, given.rate_hz)
    if held:
        progress("finding the clock of the drives")
        simulation = replace(given, rate_hz=None)
    bare_simulation = replace(given, rate_hz=simulation.rate_hz)

    def conclude(fit: ArmFit, shared: Sequence[FoundNumber]) -> MotionDiagnosis:
        taken = hold_commands(held_out, given, fit.values, tuning) if held else held_out
        judged = coupled_windows(taken, fit.simulation, fit.values, fit.tuning)
        whole = replace(fit.tuning, wanted_windows=1, longest_window_s=np.inf)
        runs = coupled_windows(taken, fit.simulation, fit.values, whole)
        stated = replace(fit, chosen=_with_stated_scale(fit, tuning))
        kept = replace(stated, chosen=_without_worse(stated, runs, tuning))
        placed = replace(fit, chosen=_place_damping(kept, judged, tuning))
        return _conclude(recording, bare_simulation, (placed, shared), (judged, runs), taken, tuning)

    def taken(servos: Sequence[Array | None]) -> Sequence[MotionRun]:
        return hold_commands(learned, given, servos, tuning) if held else learned

    fit = fit_arm(taken, simulation, firsts, progress, tuning)
    if not any(fit.chosen):
        return MotionDiagnosis(recording, simulation, "inconclusive", NO_SERVO)
    progress("replaying held-out runs")
    concluded = conclude(fit, ())
    for each, shared in _with_shared_numbers(taken, fit, progress):
        tried = conclude(each, shared)
        named = {finding.parameter.key for finding in tried.findings}
        if all(own.number.key in named for own in shared) and replays_as_well(tried, concluded, tuning):
            concluded = tried
            break
    if concluded.servos is None:
        return concluded
    return replace(
        concluded,
        simulation=replace(concluded.simulation, rate_hz=given.rate_hz),
        odd=tuple(_odd_stretches(learned, concluded.chosen, tuning)),
        seconds=time.perf_counter() - started,
    )


def _with_shared_numbers(
    taken: Callable[[Sequence[Array | None]], Sequence[MotionRun]],
    bare: ArmFit,
    progress: Callable[[str], None],
) -> list[tuple[ArmFit, tuple[FoundNumber, ...]]]:
    """The arm with numbers that all joints share and that servos alone do not explain as well, the best first.

    A delay of all commands, a mass at the tool, or both. taken: as `fit_arm` has it. bare: without them.
    """
    found = list[tuple[ArmFit, tuple[FoundNumber, ...]]]()
    progress(COMMON_DELAY.doing)
    late = weigh(COMMON_DELAY, taken, bare, progress)
    progress(TOOL_MASS.doing)
    loaded = weigh(TOOL_MASS, taken, bare, progress)
    if late is not None and loaded is not None:
        both = weigh(TOOL_MASS, taken, late[0], progress)
        found += [] if both is None else [(both[0], (late[1], both[1]))]
    found += [(fit, (number,)) for fit, number in filter(None, (late, loaded))]
    return sorted(found, key=lambda each: cost_of(each[0], bare))


def reason_unusable(recording: MotionRecording) -> str | None:
    """Why nothing can be said, in one line; None where something can."""
    findings = check_answers(recording.runs, recording.arm)
    wrong = [finding.text for finding in findings if finding.kind != "still_joint"]
    if wrong:
        return wrong[0]
    if len(findings) == len(recording.joints):
        return "no joint moves: record motion of each joint, fast and slow, in both directions"
    return None


def split_runs(
    recording: MotionRecording, held_out_share: float = DEFAULT.held_out_share
) -> tuple[list[MotionRun], list[MotionRun]]:
    """The runs that identify, and those that are held out: runs that validate, else the last third of each run."""
    learned, held_out = list(recording.with_role("identify")), list(recording.with_role("validate"))
    if not learned:
        raise InputError(f"{recording.name}: no run has the role identify")
    if not held_out:
        cuts = [int((1 - held_out_share) * run.samples) for run in learned]
        held_out = [run.rows(slice(cut, None)) for run, cut in zip(learned, cuts, strict=True)]
        learned = [run.rows(slice(cut)) for run, cut in zip(learned, cuts, strict=True)]
    return learned, held_out


def _first_fits(runs: Sequence[MotionRun], simulation: ServoSimulation, tuning: MotionTuning) -> list[Array | None]:
    """Numbers, (parameters,) of each joint, by the measured loads; None for a joint that stands still."""
    return [
        None if np.ptp(joint.position) < MIN_MOVED else first_fit(joint, nominal, tuning).values
        for joint, nominal in zip(make_windows(runs, simulation, tuning), simulation.nominal.values, strict=True)
    ]


def _with_stated_scale(fit: ArmFit, tuning: MotionTuning) -> list[ChosenServo | None]:
    """The servos with the kp of the simulation where nothing else tells the scale of their torques.

    What scales kp, damping, friction and rotor inertia alike changes no motion, but for gravity and the links' inertia.
    Where gravity is weak, and the inertia of the links is a smaller part of the whole than kp is uncertain, neither
    tells the scale: then kp is as stated, and the others are fitted anew.
    """
    out: list[ChosenServo | None] = []
    looks, kp = number_of_tests(len(fit.chosen)), place("kp")
    for each, learned in zip(fit.chosen, fit.windows, strict=True):
        if each is not None and kp in each.gains and np.isfinite(each.nominal[kp]) and _is_scale_open(each, learned):
            few = thin_windows(
                learned.select(np.setdiff1d(np.arange(learned.count), each.odd)), tuning.max_judged_windows
            )
            each = judge_again(learned, _in_scale_of(each, each.nominal[kp]).without(kp, few, tuning), looks, tuning)
        out.append(each)
    return out


def _in_scale_of(chosen: ChosenServo, gain: float) -> ChosenServo:
    """The servo with all its torques in another scale, in which kp is this."""
    values, places = chosen.fit.values.copy(), [KEYS.index(key) for key in TORQUE_SCALED]
    finite = [at for at in places if values[at] < INFINITE_LIMIT]
    values[finite] *= gain / values[place("kp")]
    return replace(chosen, fit=replace(chosen.fit, values=values))


def _is_scale_open(chosen: ChosenServo, learned: Windows) -> bool:
    """Whether neither gravity nor the inertia of the links tells the scale of a joint's torques."""
    kp, values, (low, high) = place("kp"), chosen.fit.values, chosen.fit.interval()
    uncertain = float(high[kp] - low[kp]) / (2 * values[kp])
    links = float(np.median(learned.inertia))
    return has_weak_load(learned, values) and links < uncertain * (links + float(values[place("armature")]))


def _without_worse(fit: ArmFit, judged: Sequence[Windows], tuning: MotionTuning) -> list[ChosenServo | None]:
    """The servos without the numbers that make held-out runs clearly worse than a fit of the others does.

    judged: whole runs, because a joint that sticks at another place stays there. Optional numbers leave first.
    """
    out: list[ChosenServo | None] = []
    looks = number_of_tests(len(fit.chosen))
    for each, learned, held in zip(fit.chosen, fit.windows, judged, strict=True):
        while each is not None:
            sound = learned.select(np.setdiff1d(np.arange(learned.count), each.odd))
            numbers = np.flatnonzero(each.fit.free & np.isfinite(each.nominal)).tolist()
            few = thin_windows(sound, tuning.max_judged_windows)
            others = [each.without(number, few, tuning) for number in numbers]
            own, *without = (_stretch_squares(held, one.fit.values, tuning) for one in (each, *others))
            rises = [_rise(other, own, tuning) for other in without]
            worse = [row for row, rise in enumerate(rises) if rise > tuning.clearly_worse]
            if not worse:
                break
            worst = max(worse, key=lambda row: (OPTIONAL[numbers[row]], rises[row]))
            each = judge_again(learned, others[worst], looks, tuning)
        out.append(each)
    return out


def _stretch_squares(windows: Windows, values: Array, tuning: MotionTuning) -> Array:
    """Squared error of a replay over stretches of the runs, as many as there are windows of a recording."""
    parts = np.array_split(_settled_errors(windows, values) ** 2, tuning.wanted_windows)
    return np.array([float(part.sum()) for part in parts])


def _place_damping(fit: ArmFit, judged: Sequence[Windows], tuning: MotionTuning) -> list[ChosenServo | None]:
    """The servos with a change of damping in joint or drive, whichever the held-out windows tell.

    The torque limit acts on that of the drive alone. The windows that identify have to allow both.
    """
    out: list[ChosenServo | None] = []
    for each, learned, held in zip(fit.chosen, fit.windows, judged, strict=True):
        inside = None if each is None else each.with_damping_inside()
        if each is not None and inside is not None:
            sound = learned.select(np.setdiff1d(np.arange(learned.count), each.odd)).with_integral(each.fit.integral)
            own, other = (_rms(joint_errors(sound, one.fit.values)[0]) for one in (each, inside))
            allowed = other**2 * (1 - tuning.min_gain) <= own**2
            if allowed and _rms(_settled_errors(held, inside.fit.values)) < _rms(
                _settled_errors(held, each.fit.values)
            ):
                each = inside
        out.append(each)
    return out


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
    return _rise((without / size).sum(axis=1), (with_it / size).sum(axis=1), tuning) > tuning.clearly_worse


def _conclude(
    recording: MotionRecording,
    given: ServoSimulation,
    found: tuple[ArmFit, Sequence[FoundNumber]],
    parts: tuple[Sequence[Windows], Sequence[Windows]],
    held_out: Sequence[MotionRun],
    tuning: MotionTuning,
) -> MotionDiagnosis:
    """Findings, replays and errors.

    given: the simulation to be judged; found: servos, and numbers that all joints share. parts: the held-out runs in
    windows, and whole.
    """
    (fit, shared), (judged, runs) = found, parts
    simulation, learned = fit.simulation, fit.windows
    mass_error = min((each.error for each in shared if each.number is TOOL_MASS), default=np.inf)
    holds = recording.controller is not None and recording.controller.rate_hz is not None
    sample = max(1 / run.rate_hz for run in held_out) if holds else 0.0
    step = float(given.model().opt.timestep)

    def name(number: int, each: ChosenServo) -> list[ServoFinding]:
        windows = learned[number], judged[number]
        differs = name_differences(number, each, simulation, windows, mass_error, tuning)
        return [one for one in _with_given_delay(differs, given, simulation.delay) if is_told(one)]

    def is_told(finding: ServoFinding) -> bool:
        return not (finding.is_shorter(sample) or finding.is_lead_of(step))

    def with_one_finding(
        number: int, finding: ServoFinding, each: ChosenServo
    ) -> tuple[ChosenServo, list[ServoFinding]]:
        single = each.with_one_finding(PARAMETERS.index(finding.parameter), learned[number], tuning)
        return single, name(number, single)

    def is_confirmed(number: int, values: Array) -> bool:
        nominal = with_more(given.nominal.values[number], TOOL_MASS.place, -simulation.payload)
        without, with_it = (_stretch_squares(runs[number], each, tuning) for each in (nominal, values))
        return _rise(with_it, without, tuning) > tuning.clearly_worse

    named = [[] if each is None else name(number, each) for number, each in enumerate(fit.chosen)]
    known = bool(np.isfinite(simulation.nominal.get("kp")).all())
    before = tuple(replay(given, None, held_out)) if known else ()
    simulations = given, simulation
    joints = JointTrials(is_confirmed, with_one_finding)
    chosen, named, servos, after = replay_named(simulations, fit.chosen, named, joints, before, held_out, tuning)
    findings = [finding for own in named for finding in own]
    fit = replace(fit, chosen=chosen)
    for each in shared:
        if each.number is TOOL_MASS:
            found_shared = [_name_payload(each, fit, judged, tuning)]
        else:
            found_shared = [one for one in _name_delay(each, fit, judged, findings, tuning) if is_told(one)]
        findings += [one for one in found_shared if not one.holds_nominal]
    errors = tuple(
        _errors(number, simulations, servos, judged[number], before, after, held_out) for number in range(len(chosen))
    )
    follows = {each.joint: each.follows_command(tuning) for each in errors}
    if not any(follows.values()):
        return MotionDiagnosis(recording, given, "inconclusive", NO_SERVO)
    findings = [each for each in findings if each.parameter.key == TOOL_MASS.key or follows[each.joint]]
    helped = {each.joint for each in errors if each.replay_before is None or each.replay_after < each.replay_before}
    findings = [each for each in findings if each.after < each.before and _is_at_one_of(each, helped)]
    status, reason = _status(findings, errors, chosen, tuning.same_error if known else None)
    tools = [
        float(np.sqrt(np.mean(np.concatenate([each.tool_distance for each in part]) ** 2)))
        for part in (before, after)
        if part
    ]
    simulation = replace(simulation, nominal=given.nominal, delay=0.0)
    return MotionDiagnosis(
        recording=recording,
        simulation=simulation,
        status=status,
        reason=reason,
        chosen=tuple(_with_given_nominal(chosen, given)),
        servos=servos,
        findings=tuple(findings),
        errors=errors,
        replayed_before=before,
        replayed_after=after,
        replayed_alone=np.column_stack(
            [_stretch_squares(own, values, tuning) for own, values in zip(runs, servos.values, strict=True)]
        ),
        tool=(tools[0] if before else None, tools[-1]),
        silent=tuple(
            each.joint for each, own in zip(errors, chosen, strict=True) if own is None or not follows[each.joint]
        ),
        currents=correlate_currents(held_out, simulation, servos.values),
    )


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
    """How much the squared error of each joint rises, (joints,), as `_rise` has it, over stretches of the runs."""
    without, with_it = _stretches_of_replays(before, after, tuning)
    return np.array([_rise(*pair, tuning) for pair in zip(without.T, with_it.T, strict=True)])


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


def _rise(without: Array, with_it: Array, tuning: MotionTuning) -> float:
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
        return chosen.fit.values
    if not np.isfinite(nominal).all():
        joint, name = simulation.number_of(number), simulation.arm.joints[simulation.joints[number]].name
        raise InputError(
            f"joint {joint} ({name}) shows nothing of its drive, and neither the robot's file nor `controller` "
            "tells its gain: leave it out by `joints`, or give `controller.kp` and `torque_limit`"
        )
    return np.asarray(nominal)


def _is_at_one_of(finding: ServoFinding, joints: Set[int]) -> bool:
    """Whether a finding is at one of these joints; a mass at the tool is at all."""
    return bool(joints) if finding.parameter.key == TOOL_MASS.key else finding.joint in joints


def _status(
    findings: Sequence[ServoFinding],
    errors: Sequence[JointError],
    chosen: Sequence[ChosenServo | None],
    same_error: float | None,
) -> tuple[Status, str]:
    if findings:
        return "mismatch", ""
    if same_error is None:
        return "inconclusive", "the simulation has no controller to compare with, and no number stands out"
    worse = [each for each in errors if each.before is not None and each.before > same_error * each.after]
    if worse or any(each is None for each in chosen):
        return "inconclusive", "the simulation replays the motion with an error that no number of the servos explains"
    return "none", ""


def name_differences(
    number: int,
    chosen: ChosenServo,
    simulation: ServoSimulation,
    windows: tuple[Windows, Windows],
    mass_error: float = np.inf,
    tuning: MotionTuning = DEFAULT,
) -> list[ServoFinding]:
    """The findings of one joint: parameters that earned their place and whose interval leaves out the simulation's.

    A number that was free when a finding was judged is no rival of it: it could not make up for the simulation's
    number.
    windows: of the runs that identify, and of those that are held out. mass_error: of a payload that was found, kg.
    """
    if not chosen.gains:
        return []
    learned, judged = windows
    fit, (low, high) = chosen.fit, chosen.fit.interval()
    sound = learned.select(np.setdiff1d(np.arange(learned.count), chosen.odd)).with_integral(fit.integral)
    confused = confused_parameters(sound, replace(fit, free=chosen.free), mass_error, tuning)
    unknown_gain = bool(np.isnan(simulation.nominal.values[number, place("kp")]))
    scale: tuple[str, ...] = ("inertial_parameter_error",) if unknown_gain else ()
    if has_weak_load(sound, fit.values, tuning):
        scale = ("rotor_inertia", "inertial_parameter_error")
    errors = [_settled_errors(judged, _with_nominal(chosen, each)) for each in chosen.gains]
    after, found = _rms(_settled_errors(judged, fit.values)), []
    for place_of, gain, error in zip(chosen.gains, chosen.gains.values(), errors, strict=True):
        parameter = PARAMETERS[place_of]
        fitted, ends = float(fit.values[place_of]), (float(low[place_of]), float(high[place_of]))
        unstated = unknown_gain and parameter.key == "kd"
        said = _named(parameter, fitted, ends, np.nan if unstated else float(chosen.nominal[place_of]))
        if parameter.key == "damping" and not chosen.free[place("kd")]:
            said = _name_damping(chosen, simulation.nominal.values[number])
        if parameter.key == "kp":
            said = _with_unknown_clock(said, float(fit.values[place("ki")]), tuning)
        others = [other for other in confused[place_of] if not (chosen.free[other] and np.isfinite(said.nominal))]
        rivals = (*parameter.rivals, *(PARAMETERS[other].effect for other in others))
        rivals = (*rivals, *(scale if parameter.key in TORQUE_SCALED else ()))
        before = _rms(error) if np.isfinite(said.nominal) else _rms(_command_error(judged))
        joint, chance = simulation.number_of(number), _corrected_chance(gain, len(simulation.joints))
        one = said.finding(parameter, joint, (before, after), chance, rivals)
        found += [] if one.holds_nominal else [one]
    return found


def _name_payload(payload: FoundNumber, fit: ArmFit, judged: Sequence[Windows], tuning: MotionTuning) -> ServoFinding:
    """The mass at the tool, fitted once more beside the numbers that each joint's servo has in the end."""
    more, error = estimate_shared(payload.number, [each for each in _models_of(fit) if each is not None], tuning)
    parameter, half = PARAMETERS[place("payload")], float(student.ppf(0.975, max(payload.windows - 1, 1))) * error
    joints = [(judged[number], values) for number in payload.squares if (values := fit.values[number]) is not None]
    errors = [
        [_settled_errors(joint, with_more(values, TOOL_MASS.place, less)) for joint, values in joints]
        for less in (-fit.simulation.payload, 0.0)
    ]
    mass = fit.simulation.payload + more
    before, after = (_rms(np.concatenate(each)) for each in errors)
    said = _Said(parameter.effect, parameter.name, mass, (mass - half, mass + half), 0.0)
    chance = _corrected_chance(payload.gain, len(judged))
    return said.finding(parameter, fit.simulation.last_link, (before, after), chance, parameter.rivals)


def _name_delay(
    delay: FoundNumber, fit: ArmFit, judged: Sequence[Windows], named: Sequence[ServoFinding], tuning: MotionTuning
) -> list[ServoFinding]:
    """The delay of all commands at each joint that has no delay of its own, fitted once more beside the other numbers.

    named: what joints have of their own.
    """
    own = {each.joint for each in named if each.parameter.key == COMMON_DELAY.key}
    models = {
        number: replace(each, values=COMMON_DELAY.without_own(each.values, fit.simulation.nominal.values[number]))
        for number, each in enumerate(_models_of(fit))
        if each is not None and fit.simulation.number_of(number) not in own
    }
    more, error = estimate_shared(delay.number, list(models.values()), tuning)
    parameter, half = PARAMETERS[COMMON_DELAY.place], float(student.ppf(0.975, max(delay.windows - 1, 1))) * error
    found = []
    for number, model in models.items():
        given = float(fit.simulation.nominal.get("delay")[number]) - fit.simulation.delay
        seconds = given + fit.simulation.delay + more
        said = _named(parameter, seconds, (seconds - half, seconds + half), given)
        before, after = (
            _rms(_settled_errors(judged[number], with_more(model.values, COMMON_DELAY.place, less)))
            for less in (-fit.simulation.delay, 0.0)
        )
        chance = _corrected_chance(delay.gain, len(judged))
        joint = fit.simulation.number_of(number)
        found.append(said.finding(parameter, joint, (before, after), chance, parameter.rivals))
    return found


def _models_of(fit: ArmFit) -> list[JointModel | None]:
    """Each joint with its servo in the end; None without one."""
    return [
        None if each is None else JointModel(joint.with_integral(each.fit.integral), each.fit.values, each.fit.free)
        for joint, each in zip(fit.windows, fit.chosen, strict=True)
    ]


def _corrected_chance(gain: Gain, joints: int) -> float:
    """P-value of no gain, corrected for all tests of an arm."""
    return min(gain.p_value * TESTS_OF_GAIN * number_of_tests(joints), 1.0)


def _with_given_delay(findings: Sequence[ServoFinding], given: ServoSimulation, delay: float) -> Iterator[ServoFinding]:
    """The findings of a joint, its own delay compared with the simulation as given, not with the delay of all commands.

    A delay whose interval holds the given one is left out. delay: of all commands, s.
    """
    for each in findings:
        if delay and each.parameter.key == COMMON_DELAY.key:
            row = given.joints.index(each.joint - 1)
            each = replace(each, nominal=float(given.nominal.get("delay")[row]))
            if each.holds_nominal:
                continue
        yield each


def _with_given_nominal(chosen: Sequence[ChosenServo | None], given: ServoSimulation) -> Iterator[ChosenServo | None]:
    """The servos with the delays of the simulation that is given as nominal ones."""
    for each, delay in zip(chosen, given.nominal.get("delay"), strict=True):
        if each is not None:
            nominal = each.nominal.copy()
            nominal[COMMON_DELAY.place] = delay
            each = replace(each, nominal=nominal)
        yield each


@dataclass(frozen=True)
class _Said:
    """How a difference is named: effect, name of the number, its value and interval, and that of the simulation."""

    effect: str
    name: str
    value: float
    ends: tuple[float, float]
    nominal: float

    def finding(
        self,
        parameter: ServoParameter,
        joint: int,
        errors: tuple[float, float],
        p_value: float,
        rivals: tuple[str, ...],
    ) -> ServoFinding:
        """The finding that says it at a joint, from 1. errors: before and after, rad.

        The effect of the parameter is a rival where the difference has another name.
        """
        others = (each for each in (parameter.effect, *rivals) if each != self.effect)
        return ServoFinding(
            parameter=parameter,
            effect=self.effect,
            name=self.name,
            joint=joint,
            value=self.value,
            interval=self.ends,
            nominal=self.nominal,
            before=errors[0],
            after=errors[1],
            p_value=p_value,
            rivals=tuple(dict.fromkeys(others)),
        )


def _named(parameter: ServoParameter, value: float, ends: tuple[float, float], nominal: float) -> _Said:
    if parameter.key == "delay" and value < 0:  # what is early is read late
        return _Said("channel_skew", "seconds", -value, (-ends[1], -ends[0]), nominal)
    return _Said(parameter.effect, parameter.name, value, ends, nominal)


def _with_unknown_clock(said: _Said, ki: float, tuning: MotionTuning) -> _Said:
    """kp of a drive that may use its integral before or after it adds to it: half a period of its clock times ki."""
    more = ki * tuning.drive_period_s / 2
    return replace(said, ends=(said.ends[0] - more, said.ends[1] + more))


def _name_damping(chosen: ChosenServo, given: Array) -> _Said:
    """The damping of a joint beside the simulation's kd, or another kd. given: numbers of the simulation.

    With an unknown kp, it is that of joint and drive together. Friction is not negative: below none, kd is too large.
    """
    kd, damping = place("kd"), place("damping")
    values, nominal = chosen.fit.values, float(given[damping])
    half = float(chosen.fit.interval()[1, damping] - values[damping])
    value = float(values[damping] + values[kd] - given[kd])
    if values[kd] != chosen.nominal[kd] and np.isfinite(given[place("kp")]):
        found = value - nominal + float(given[kd])
        return _Said("controller_gain_error", "kd", found, (max(found - half, 0.0), found + half), float(given[kd]))
    if value + half < 0:
        found = value + float(given[kd])
        return _Said("controller_gain_error", "kd", found, (0.0, found + half), float(given[kd]))
    return _Said("viscous_friction", "coefficient", value, (max(value - half, 0.0), value + half), nominal)


def _with_nominal(chosen: ChosenServo, number: int) -> Array:
    """The fitted numbers with that of the simulation at a place; damping is that of joint and drive together."""
    changed, nominal = chosen.fit.values.copy(), chosen.nominal
    numbers = [number, place("kd")] if number == place("damping") and not chosen.free[place("kd")] else [number]
    changed[numbers] = np.where(np.isfinite(nominal[numbers]), nominal[numbers], changed[numbers])
    return changed


def _rms(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2)))


def _settled_errors(windows: Windows, values: Array) -> Array:
    """Errors (samples,) of a replay whose drive's integral at the start of each run fits best, rad."""
    return np.asarray(joint_errors(settle(windows, values), values)[0])


def _command_error(windows: Windows) -> Array:
    """Command minus position at the samples, rad: the error of a servo that follows without any error."""
    command = windows.command[windows.window, windows.history + windows.row]
    return np.asarray(command - windows.position)


def _errors(
    number: int,
    simulations: tuple[ServoSimulation, ServoSimulation],
    servos: Servos,
    judged: Windows,
    before: Sequence[Replayed],
    after: Sequence[Replayed],
    held_out: Sequence[MotionRun],
) -> JointError:
    given, simulation = simulations
    nominal = given.nominal.values[number]
    known = bool(np.isfinite(nominal).all())
    commands = np.concatenate(
        [np.asarray(run.reference_position)[:, number] - run.position[:, number] for run in held_out]
    )
    return JointError(
        joint=given.number_of(number),
        before=_rms(_settled_errors(judged, with_more(nominal, TOOL_MASS.place, -simulation.payload)))
        if known
        else None,
        after=_rms(_settled_errors(judged, servos.values[number])),
        replay_before=float(joint_rms(before)[number]) if before else None,
        replay_after=float(joint_rms(after)[number]),
        command=_rms(commands),
        spread=float(np.std(np.concatenate([run.position[:, number] for run in held_out]))),
        floor=judged.encoder_noise,
    )


def _odd_stretches(
    runs: Sequence[MotionRun], chosen: Sequence[ChosenServo | None], tuning: MotionTuning
) -> list[tuple[str, float, float]]:
    """Run, first and last instant of the windows that the servo of some joint does not explain."""
    stretches = window_stretches(runs, tuning)
    odd = {window for each in chosen if each is not None for window in each.odd.tolist()}
    return sorted(stretches[window] for window in odd)
