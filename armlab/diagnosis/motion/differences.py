"""What differs from the simulation, by name: the numbers of each joint, and those that all joints share."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import t as student

from armlab.common.arrays import Array
from armlab.diagnosis.motion.arm_fit import ArmFit, number_of_tests
from armlab.diagnosis.motion.choose import TESTS_OF_GAIN, ChosenServo, GainOfNumber
from armlab.diagnosis.motion.estimate import ServoFit, rms_of
from armlab.diagnosis.motion.held_out import command_error, settled_errors
from armlab.diagnosis.motion.motion_result import ServoFinding
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.separate import TORQUE_SCALED, confused_parameters, has_weak_load
from armlab.diagnosis.motion.servo import PARAMETERS, ServoParameter, place
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.diagnosis.motion.shared_number import (
    COMMON_DELAY,
    TOOL_MASS,
    FoundNumber,
    JointModel,
    estimate_shared,
    with_more,
)
from armlab.diagnosis.motion.windows import Windows


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
    sound = _sound_windows(learned, chosen)
    confused = confused_parameters(sound, replace(fit, free=chosen.free), mass_error, tuning)
    unknown_gain = bool(np.isnan(simulation.nominal.values[number, place("kp")]))
    scale = _rivals_by_scale(unknown_gain, sound, fit, tuning)
    errors = [settled_errors(judged, _with_nominal(chosen, each)) for each in chosen.gains]
    after, found = rms_of(settled_errors(judged, fit.values)), []
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
        rivals = _rivals_of(parameter, others, scale)
        before = rms_of(error) if np.isfinite(said.nominal) else rms_of(command_error(judged))
        joint, chance = simulation.number_of(number), _corrected_chance(gain, len(simulation.joints))
        one = said.finding(parameter, joint, (before, after), chance, rivals)
        found += [] if one.holds_nominal else [one]
    return found


def rivals_of_numbers(
    number: int,
    chosen: ChosenServo,
    simulation: ServoSimulation,
    learned: Windows,
    mass_error: float = np.inf,
    tuning: MotionTuning = DEFAULT,
) -> dict[int, tuple[str, ...]]:
    """The effects that the motion of a joint does not tell from each number that was fitted, by the number's place.

    learned: windows of the runs that identify. mass_error: as in `name_differences`.
    """
    sound, fit = _sound_windows(learned, chosen), chosen.fit
    confused = confused_parameters(sound, fit, mass_error, tuning)
    unknown_gain = bool(np.isnan(simulation.nominal.values[number, place("kp")]))
    scale = _rivals_by_scale(unknown_gain, sound, fit, tuning)
    out = {at: _rivals_of(PARAMETERS[at], others, scale) for at, others in confused.items()}
    return {at: rivals for at, rivals in out.items() if rivals}


def _sound_windows(learned: Windows, chosen: ChosenServo) -> Windows:
    """The windows that a servo explains."""
    return learned.select(np.setdiff1d(np.arange(learned.count), chosen.odd)).with_integral(chosen.fit.integral)


def _rivals_by_scale(unknown_gain: bool, sound: Windows, fit: ServoFit, tuning: MotionTuning) -> tuple[str, ...]:
    """Effects that the factor of all torques may be of. unknown_gain: whether the simulation has no kp."""
    if has_weak_load(sound, fit.values, tuning):
        return ("rotor_inertia", "inertial_parameter_error")
    return ("inertial_parameter_error",) if unknown_gain else ()


def _rivals_of(parameter: ServoParameter, others: Sequence[int], scale: tuple[str, ...]) -> tuple[str, ...]:
    """Each effect once. others: places of parameters; scale: effects that scale all torques."""
    confused = (PARAMETERS[other].effect for other in others)
    scaled = scale if parameter.key in TORQUE_SCALED else ()
    return tuple(dict.fromkeys((*parameter.rivals, *confused, *scaled)))


def name_payload(payload: FoundNumber, fit: ArmFit, judged: Sequence[Windows], tuning: MotionTuning) -> ServoFinding:
    """The mass at the tool, fitted once more beside the numbers that each joint's servo has in the end."""
    more, error = estimate_shared(payload.number, [each for each in _models_of(fit) if each is not None], tuning)
    parameter, half = PARAMETERS[place("payload")], float(student.ppf(0.975, max(payload.windows - 1, 1))) * error
    joints = [(judged[number], values) for number in payload.squares if (values := fit.values[number]) is not None]
    errors = [
        [settled_errors(joint, with_more(values, TOOL_MASS.place, less)) for joint, values in joints]
        for less in (-fit.simulation.payload, 0.0)
    ]
    mass = fit.simulation.payload + more
    before, after = (rms_of(np.concatenate(each)) for each in errors)
    said = _Said(parameter.effect, parameter.name, mass, (mass - half, mass + half), 0.0)
    chance = _corrected_chance(payload.gain, len(judged))
    return said.finding(parameter, fit.simulation.last_link, (before, after), chance, parameter.rivals)


def name_delay(
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
            rms_of(settled_errors(judged[number], with_more(model.values, COMMON_DELAY.place, less)))
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


def _corrected_chance(gain: GainOfNumber, joints: int) -> float:
    """P-value of no gain, corrected for all tests of an arm."""
    return min(gain.p_value * TESTS_OF_GAIN * number_of_tests(joints), 1.0)


def with_given_delay(findings: Sequence[ServoFinding], given: ServoSimulation, delay: float) -> Iterator[ServoFinding]:
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


def with_given_nominal(chosen: Sequence[ChosenServo | None], given: ServoSimulation) -> Iterator[ChosenServo | None]:
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

    With an unknown kp, it is that of joint and drive together. What was changed more has the name. Friction is not
    negative: below none, kd is too large.
    """
    kd, damping = place("kd"), place("damping")
    values, nominal = chosen.fit.values, float(given[damping])
    half = float(chosen.fit.interval()[1, damping] - values[damping])
    value = float(values[damping] + values[kd] - given[kd])
    if chosen.has_other_kd and np.isfinite(given[place("kp")]):
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
