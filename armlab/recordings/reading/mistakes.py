"""The table of mistakes: each function lists the readings in which one mistake of a kind is taken back.

| effect | what is tried |
|---|---|
| torque_sign, joint_direction | each joint, and the torque of all |
| channel_swap, channel_order | each pair of columns; all columns shifted by one, backwards, or in alphabetical order |
| encoder_offset | each joint that turns, in steps of 45 degrees, then refined |
| unit_error, gear_ratio | factors between usual units, and ratios of gears |
| base_tilt, gravity_compensated_torque | gravity along axes and diagonals, then refined; none, or of links |
| dh_convention, inertia_reference, link_data_error | other meanings of the numbers of the robot file |
| axis_coupling | a column that counts the sum or the difference of two joints in a row, with and without its torque |
| clock_error, time_delay, channel_skew | factors of time and shifts of torque, then refined |

Springs of joints stand beside them. They are physics, but a wrong reading may fit an arm that has one better.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product

import numpy as np

from armlab.common.arrays import Array
from armlab.common.settings import read_yaml, validate
from armlab.recordings.reading.reading import BOTH, LINK_DATA, OF_LINKS, SPRING, Mistake, Reading
from armlab.recordings.recording import Recording
from problem.arm import Arm
from problem.pseudo_inertia import link_from_centre_of_mass, links_of
from problem.robot_file import BUILT_IN_FOLDER, RobotFile, built_in_arms

POSITION, TORQUE, TIME = "position", "torque", "time"
DEGREES = 180 / np.pi
STANDARD_GRAVITY = 9.81  # m/s2
UNIT_FACTORS = {POSITION: (DEGREES, 1 / DEGREES, 1000.0, 1e-3), TORQUE: (1000.0, 1e-3), TIME: (1000.0, 1e-3)}
TORQUE_UNITS = (1000.0, 1e-3, 9.80665, 1 / 9.80665, 8.850746, 1 / 8.850746)  # N mm, kgf m, lbf in
GEAR_RATIOS = tuple(np.geomspace(5, 300, 83).tolist())
QUARTERS = (90, 180, -90)
ZERO_STEPS = tuple(range(-135, 181, 45))  # degrees


def signs(reading: Reading) -> Iterator[Reading]:
    """Joints that count, or report torque, the other way round."""
    for joint in range(reading.joints):
        turned = reading.scale_torque(joint, -1.0)
        yield turned.with_mistake(Mistake("torque_sign", joint + 1))
        for form, start in ((POSITION, reading), (BOTH, turned)):
            yield start.scale_position(joint, -1.0).with_mistake(Mistake("joint_direction", joint + 1, form=form))
    if reading.joints > 1:
        yield reading.scale_torque(slice(None), -1.0).with_mistake(Mistake("torque_sign"))


def exchanges(reading: Reading, names: tuple[str, ...]) -> Iterator[Reading]:
    """Columns in another order. names: of the joints."""
    count = reading.joints
    for first, second in combinations(range(count), 2):
        exchanged = list(range(count))
        exchanged[first], exchanged[second] = second, first
        for form in (POSITION, TORQUE, BOTH):
            mistake = Mistake("channel_swap", joints=(first + 1, second + 1), form=form)
            yield reading.reorder(tuple(exchanged), form).with_mistake(mistake)
    own = tuple(range(count))
    # recorded columns that stand in alphabetical order of the joints, where the order of the robot was named
    alphabetical = tuple(int(place) for place in np.argsort(np.argsort(names)))
    for order in {own[::-1], (*own[1:], 0), (own[-1], *own[:-1]), alphabetical}:
        if sum(place != each for place, each in enumerate(order)) > 2:
            for form in (POSITION, TORQUE, BOTH):
                mistake = Mistake("channel_order", joints=tuple(each + 1 for each in order), form=form)
                yield reading.reorder(order, form).with_mistake(mistake)


def couplings(reading: Reading) -> Iterator[Reading]:
    """Columns that count a joint and the one before it together: motors that sit on the base, wrists, pendants.

    raw_b = q_b + s q_a, where the motor drives both: tau_a = T_a + s T_b (both do the same work).
    """
    for joint in range(1, reading.joints):
        for sign in (1.0, -1.0):
            for form in (POSITION, BOTH):
                yield axis_coupling(reading, joint, sign, form)


def axis_coupling(reading: Reading, joint: int, sign: float, form: str) -> Reading:
    """The reading of a column that counts a joint (from 0) plus `sign` times the one before it."""
    position, torque = reading.position.copy(), reading.torque.copy()
    position[joint] -= sign * position[joint - 1]
    if form == BOTH:
        torque[joint - 1] += sign * torque[joint]
    parameters = (
        ("factor", sign, ""),
        ("position", tuple(position.ravel().tolist()), ""),
        ("torque", tuple(torque.ravel().tolist()), ""),
    )
    mistake = Mistake("axis_coupling", joints=(joint, joint + 1), form=form, parameters=parameters)
    return replace(reading, position=position, torque=torque).with_mistake(mistake)


def unit_error(reading: Reading, joint: int | None, form: str, factor: float) -> Reading:
    """The reading without a factor: recorded = factor x true."""
    number = None if joint is None else joint + 1
    mistake = Mistake("unit_error", number, form=form, parameters=(("factor", factor, ""),))
    if form == TIME:
        return replace(reading, clock=reading.clock * factor).with_mistake(mistake)
    if form == TORQUE:
        return reading.scale_torque(slice(None) if joint is None else joint, 1 / factor).with_mistake(mistake)
    alike = _joints_of_unit(reading, factor) if joint is None else [joint]
    for each in alike:
        reading = reading.scale_position(each, 1 / factor)
    return reading.with_mistake(mistake)


def units(reading: Reading) -> Iterator[Reading]:
    """Usual units that were taken for each other."""
    for form, factors in UNIT_FACTORS.items():
        for factor in factors:
            places = list(range(reading.joints)) if form == TORQUE else []
            if form == POSITION:
                places = _joints_of_unit(reading, factor)
            if form == TIME or len(places) > 1:
                yield unit_error(reading, None, form, factor)
            for joint in places:
                yield unit_error(reading, joint, form, factor)


def _joints_of_unit(reading: Reading, factor: float) -> list[int]:
    """Joints (from 0) whose position may be off by a factor: those that turn by degrees, those that slide by mm."""
    kind = "revolute" if factor in (DEGREES, 1 / DEGREES) else "prismatic"
    return [number for number, joint in enumerate(reading.arm.joints) if joint.kind == kind]


def gear_ratio(reading: Reading, joint: int, ratio: float) -> Reading:
    """The reading of a joint that was recorded on the other side of a gear: position = ratio x true, torque / ratio."""
    mistake = Mistake("gear_ratio", joint + 1, parameters=(("ratio", ratio, ""),))
    return reading.scale_position(joint, 1 / ratio).scale_torque(joint, ratio).with_mistake(mistake)


def encoder_offset(reading: Reading, joint: int, angle: float) -> Reading:
    """The reading with another zero of a joint. angle: rad (m), what has to be added."""
    unit = "rad" if reading.arm.joints[joint].kind == "revolute" else "m"
    mistake = Mistake("encoder_offset", joint + 1, parameters=(("offset", angle, unit),))
    return reading.shift_zero(joint, angle).with_mistake(mistake)


def base_tilt(reading: Reading, gravity: Array) -> Reading:
    """The reading with another gravity (3,), m/s2."""
    vector = tuple(float(value) for value in gravity)
    return reading.with_gravity(gravity).with_mistake(Mistake("base_tilt", parameters=(("gravity", vector, "m/s2"),)))


def size_of_gravity(reading: Reading) -> float:
    """Of the robot file, m/s2; the standard one where it states none."""
    return float(np.linalg.norm(reading.arm.gravity)) or STANDARD_GRAVITY


def gravity_directions(reading: Reading) -> Iterator[Reading]:
    """Gravity of the same size along the axes and the space diagonals of the base frame."""
    size = size_of_gravity(reading)
    for direction in product((-1, 0, 1), repeat=3):
        length = float(np.linalg.norm(direction))
        if length > 0 and len([each for each in direction if each]) != 2:
            gravity = size * np.array(direction) / length
            if np.linalg.norm(gravity - np.array(reading.arm.gravity)) > 0.1 * size:
                yield base_tilt(reading, gravity)


def without_gravity(reading: Reading) -> Reading:
    """The reading in which the drive reports torque without gravity."""
    return reading.with_gravity(np.zeros(3)).with_mistake(Mistake("gravity_compensated_torque"))


def with_gravity_of_links(reading: Reading) -> Iterator[Reading]:
    """The reading in which the drive takes the gravity of the robot file's links from the torque, and of no load."""
    if reading.arm.links is not None and not reading.adds_gravity:
        mistake = Mistake("gravity_compensated_torque", form=OF_LINKS)
        yield replace(reading, adds_gravity=True).with_mistake(mistake)


def late_torque(reading: Reading, joint: int | None, seconds: float) -> Reading:
    """The reading in which the torque, of one joint or of all, is late."""
    effect = "time_delay" if joint is None else "channel_skew"
    mistake = Mistake(effect, None if joint is None else joint + 1, parameters=(("seconds", seconds, "s"),))
    return reading.late_by(seconds, joint).with_mistake(mistake)


def clock_error(reading: Reading, factor: float) -> Reading:
    """The reading in which recorded time is true time times a factor."""
    mistake = Mistake("clock_error", parameters=(("factor", factor, ""),))
    return replace(reading, clock=reading.clock * factor).with_mistake(mistake)


def robot_file_meanings(reading: Reading, recording: Recording) -> Iterator[Reading]:
    """Other meanings of the numbers in the robot file."""
    file = read_robot_file(recording)
    if file is None:
        return
    other = "modified" if file.dh_convention == "standard" else "standard"
    arm = file.model_copy(update={"dh_convention": other}).build()
    changed = replace(reading.arm, joints=arm.joints)
    yield replace(reading, arm=changed).with_mistake(Mistake("dh_convention", form=other))
    if reading.inertial is None or recording.simulation is not None:
        return
    for form in ("inertia", "centre", "inertia and centre"):
        yield _with_links(reading, _moved_reference(reading.inertial, form), Mistake("inertia_reference", form=form))
    ten = np.arange(10)
    shapes = {
        ("centre_sign", -1.0): (ten >= 1) & (ten <= 3),
        ("mass_unit", 1000.0): ten >= 0,
        ("mass_unit", 1e-3): ten >= 0,
        ("inertia_unit", 1e6): ten >= 4,
        ("inertia_unit", 1e3): ten >= 4,
    }
    for (form, factor), chosen in shapes.items():
        scale = np.where(chosen, 1 / factor, 1.0)
        for link in (None, *range(reading.joints)):
            factors = np.ones((reading.joints, 10))
            factors[slice(None) if link is None else link] = scale
            number = None if link is None else link + 1
            parameters = (("factor", factor, ""),) if factor != -1.0 else ()
            mistake = Mistake(LINK_DATA, number, form=form, parameters=parameters)
            yield _with_links(reading, reading.inertial * factors.ravel(), mistake)


def _with_links(reading: Reading, inertial: Array, mistake: Mistake) -> Reading:
    return replace(reading, inertial=inertial).with_mistake(mistake)


def _moved_reference(inertial: Array, form: str) -> Array:
    """Links whose inertias were about the centre of mass, or whose first moments were centres."""
    out = []
    for link in links_of(inertial):
        moment = np.array(link.first_moment)
        centre = moment if "centre" in form else moment / link.mass if link.mass > 0 else 0 * moment
        xx, yy, zz, xy, xz, yz = link.inertia
        body = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        own = link.mass * (centre @ centre * np.eye(3) - np.outer(centre, centre))
        about_centre = body if "inertia" in form else body - own
        out.append(link_from_centre_of_mass(link.mass, centre, about_centre).parameters)
    return np.concatenate(out)


def read_robot_file(recording: Recording) -> RobotFile | None:
    """The D-H table and the links of the robot, None for a URDF."""
    if recording.robot in built_in_arms():
        path = BUILT_IN_FOLDER / f"{recording.robot}.yaml"
    else:
        path = recording.folder / recording.robot
    return validate(RobotFile, read_yaml(path), str(path)) if path.suffix in (".yaml", ".yml") else None


def spring(reading: Reading, joint: int) -> Reading:
    """The reading of a joint (from 0) that has a spring or a gravity compensator."""
    return reading.with_spring(joint).with_mistake(Mistake(SPRING, joint + 1))


def springs(reading: Reading) -> Iterator[Reading]:
    """Springs of joints that have none yet."""
    return (spring(reading, joint) for joint in range(reading.joints) if joint not in reading.springs)


def joint_names(arm: Arm) -> tuple[str, ...]:
    """Names of the joints in the order of the robot file."""
    return tuple(joint.name for joint in arm.joints)


# threads in which a mistake of this kind was found and confirmed (docs/reading.md), and how many readings of it are
# tried: of the whole arm, for each joint, and for each pair of joints
THREADS_AND_READINGS = {
    "torque_sign": (3, 1, 1, 0),
    "joint_direction": (5, 0, 2, 0),
    "channel_swap": (4, 0, 0, 3),
    "channel_order": (6, 12, 0, 0),
    "axis_coupling": (9, 0, 4, 0),
    "encoder_offset": (6, 0, len(ZERO_STEPS), 0),
    "unit_error": (17, 6, 6, 0),
    "gear_ratio": (5, 0, 2 * len(GEAR_RATIOS), 0),
    "base_tilt": (6, 14, 0, 0),
    "gravity_compensated_torque": (7, 2, 0, 0),
    "dh_convention": (3, 1, 0, 0),
    "inertia_reference": (3, 3, 0, 0),
    LINK_DATA: (11, 5, 5, 0),
    "clock_error": (5, 13, 0, 0),
    "time_delay": (2, 20, 0, 0),
    "channel_skew": (3, 0, 20, 0),
    SPRING: (1, 0, 1, 0),
}
OF_TIME = ("time_delay", "channel_skew")  # torque that is late, as friction is that turns over a way
# what has a joint to choose and gives it another motion: the best joint alone is the evidence
OF_ONE_JOINT = ("joint_direction", "axis_coupling", "channel_swap", "channel_order", "encoder_offset", "gear_ratio")


def improbability(mistake: Mistake, joints: int) -> float:
    """Nats by which a reading is less probable than one of the commonest kind, were that the only one of its kind.

    A kind is as common as the threads in which it was found; its readings share that.
    """
    threads, arm, each, pair = THREADS_AND_READINGS[mistake.effect]
    readings = arm + each * joints + pair * joints * (joints - 1) // 2
    commonest = max(count for count, *_ in THREADS_AND_READINGS.values())
    return float(np.log(readings * commonest / threads))


def position_factor(mistake: Mistake) -> float:
    """Recorded over true position of the joints of a mistake, its size: 1 where it scales none."""
    if mistake.effect == "gear_ratio":
        return abs(mistake.value("ratio"))
    scales = mistake.effect == "unit_error" and mistake.form == POSITION
    return mistake.value("factor") if scales else 1.0


def is_of_one_joint(mistake: Mistake) -> bool:
    """Whether a mistake is told by one joint, which is chosen among all, and not by all joints together."""
    single = mistake.joint is not None and mistake.effect in ("torque_sign", "unit_error")
    return single or mistake.effect in OF_ONE_JOINT


def contradicted_by(mistake: Mistake) -> frozenset[int]:
    """Joints (from 1) whose torque would not follow their own friction, were the mistake there.

    Its sign or its column is that of another joint, in position or in torque alone. Any of them that leaves little of
    its torque is read rightly. A wrong factor hides in friction, and a wrong zero shows at other joints.
    """
    if mistake.effect == "torque_sign" or mistake.form in (POSITION, TORQUE):
        if mistake.effect == "channel_order":
            return frozenset(place for place, own in enumerate(mistake.joints, 1) if place != own)
        if mistake.effect in ("torque_sign", "joint_direction", "channel_swap"):
            return frozenset(mistake.joints or (mistake.joint or 0,))
        if mistake.effect == "axis_coupling":
            return frozenset(mistake.joints[1:])
        if mistake.effect == "unit_error" and mistake.form == TORQUE and mistake.joint is not None:
            return frozenset((mistake.joint,))
    return frozenset()


def take_back(reading: Reading, mistake: Mistake, recording: Recording) -> Reading:
    """The reading without a mistake of this table.

    Raises ValueError for a mistake that is not of this table.
    """
    joint = None if mistake.joint is None else mistake.joint - 1
    if mistake.effect == SPRING:
        return spring(reading, joint or 0)
    if mistake.effect == "encoder_offset":
        return encoder_offset(reading, joint or 0, mistake.value("offset"))
    if mistake.effect == "axis_coupling":
        return axis_coupling(reading, mistake.joints[1] - 1, mistake.value("factor"), mistake.form)
    if mistake.effect == "unit_error":
        return unit_error(reading, joint, mistake.form, mistake.value("factor"))
    if mistake.effect == "gear_ratio":
        return gear_ratio(reading, joint or 0, mistake.value("ratio"))
    if mistake.effect == "base_tilt":
        return base_tilt(reading, np.array(mistake.parameters[0][1]))
    if mistake.effect in OF_TIME:
        return late_torque(reading, joint, mistake.value("seconds"))
    if mistake.effect == "clock_error":
        return clock_error(reading, mistake.value("factor"))
    exact = [
        *signs(reading),
        *exchanges(reading, joint_names(reading.arm)),
        without_gravity(reading),
        *with_gravity_of_links(reading),
        *robot_file_meanings(reading, recording),
    ]
    for each in exact:
        if each.mistakes[-1] == mistake:
            return each
    raise ValueError(f"no such mistake: {mistake}")
