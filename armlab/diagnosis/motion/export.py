"""The servos of a diagnosis as MJCF, and what the fields of a simulator cannot express of them.

MJCF: kp and kv in the actuator, limit as its forcerange, delay as its delay (with a buffer of commands), damping,
friction and armature in the joint. kv is that of the simulation, or 0 where damping outside the force range explains
the motion better. The friction loss gets a `solimpfriction` that sticks: with MuJoCo's own a loaded joint creeps.
"""

import json
import math
from collections.abc import Iterator, Mapping, Sequence

from armlab.diagnosis.motion.servo import INFINITE_LIMIT, Key, Servos
from armlab.diagnosis.motion.servo_plugin import NUMBERS
from armlab.diagnosis.motion.servo_simulation import ServoSimulation
from armlab.identification.mjcf_edit import Drive, Meant, edit_mjcf, edit_mjcf_file, stated_fields
from problem.mjcf import body_inertia, compile_mjcf, compile_mjcf_text
from problem.mjcf_document import moved_mjcf

JOINT_FIELDS: dict[str, Key] = {"damping": "damping", "armature": "armature", "frictionloss": "friction"}
MAX_DELAY_ERROR = 0.01  # of a delay: what rounding to whole steps may change without a line


def mjcf_text(simulation: ServoSimulation, servos: Servos) -> tuple[str, tuple[str, ...]]:
    """The simulation with the numbers of servos, as MJCF, and what a person has to know of it, one line each.

    The text of the robot's MJCF stays but for the numbers; paths of meshes are made absolute. Raises InputError where
    MuJoCo does not read the numbers.
    """
    path, text = simulation.path, simulation.document
    before = compile_mjcf(path) if text is None else compile_mjcf_text(text, path)
    with_payload = simulation.model()
    stated = stated_fields(before, simulation.joints)
    rows = {place: row for row, place in enumerate(simulation.joints)}
    numbers = {name: servos.get(key) for name, key in JOINT_FIELDS.items()}
    meant = Meant(
        inertias={number: body_inertia(with_payload, number) for number in range(1, before.nbody)},
        joints=simulation.joints,
        fields={**stated, **numbers},
        gravity=before.opt.gravity,
        drives={place: _drive(servos.of_joint(row), float(servos.get("delay")[row])) for place, row in rows.items()},
    )
    if text is not None:
        return edit_mjcf(text, path, before, meant), ()
    edited, notes = edit_mjcf_file(path, before, meant)
    return moved_mjcf(edited, path, None), notes


def _drive(servo: Mapping[str, float | None], delay: float) -> Drive:
    limit = servo["limit"]
    return Drive(
        kp=servo["kp"] or 0.0,
        kv=servo["kd"] or 0.0,
        limit=math.inf if limit is None or limit >= INFINITE_LIMIT else limit,
        delay=max(delay, 0.0),
    )


def lines_without_field(simulation: ServoSimulation, servos: Servos, with_field: Sequence[str] = ()) -> Iterator[str]:
    """What a simulator has no field for, one line a number, with what to do instead; with_field: what it has."""
    for row, place in enumerate(simulation.joints):
        name = simulation.arm.joints[place].name
        offset, band = float(servos.get("offset")[row]), float(servos.get("dead_band")[row])
        share, delay = float(servos.get("load_friction")[row]), float(servos.get("delay")[row])
        if offset:
            yield f"{name}: add {offset:.4g} rad to the command (command offset)"
        if band:
            yield f"{name}: send the position itself where |command - position| is below {band / 2:.4g} rad (dead band)"
        slope = float(servos.get("limit_slope")[row])
        if slope:
            yield (
                f"{name}: lower the torque limit by {slope:.4g} N m s/rad times the speed at each step, where the "
                "drive does work (torque limit)"
            )
        if share:
            yield (
                f"{name}: add {share:.4g} |load| to the friction at each step; load: torque that moves and holds the "
                "links, mj_rne with accelerations in MuJoCo (friction that grows with load)"
            )
        excess, speed = float(servos.get("static_excess")[row]), float(servos.get("stribeck_speed")[row])
        if excess:
            yield (
                f"{name}: add {excess:.4g} exp(-(velocity / {speed:.4g} rad/s)^2) N m to the friction at each step "
                "(Stribeck friction)"
            )
        gain = float(servos.get("ki")[row])
        if gain and "integral gain" not in with_field:
            most = float(servos.get("integral_limit")[row])
            wound_up = f", at most {most:.4g} N m" if most < INFINITE_LIMIT else ""
            yield f"{name}: add {gain:.4g} N m/(rad s) times the integral of the error{wound_up} (integral gain)"
        of_speed = float(servos.get("ki_speed")[row])
        if of_speed:
            yield (
                f"{name}: subtract {of_speed:.4g} N m/rad times the error, and let the integral grow by as much times "
                "the velocity less (a cascade, whose integral acts on the velocity, too)"
            )
        if delay < 0:
            yield f"{name}: the position was read {-1e3 * delay:.3g} ms after its stamp (no field is needed)"
    if simulation.payload:
        yield f"{simulation.payload:.4g} kg more at the tool: simulation.xml and robot.urdf have it (payload)"
    if simulation.rate_hz is not None:
        yield f"the servos take a command over {simulation.rate_hz:g} times a second and hold it: send it at that rate"
    if simulation.supply is not None:
        yield f"kp and torque limit hold at {simulation.supply:g} V: scale both with the supply voltage"


def delay_steps(simulation: ServoSimulation, servos: Servos, step_s: float) -> tuple[list[int], list[str]]:
    """Delay of each joint's command in steps of the physics, and a line for each that steps do not hold exactly."""
    steps, lines = [], []
    for row, place in enumerate(simulation.joints):
        delay = max(float(servos.get("delay")[row]), 0.0)
        steps.append(round(delay / step_s))
        if abs(steps[-1] * step_s - delay) > MAX_DELAY_ERROR * delay:
            lines.append(
                f"{simulation.arm.joints[place].name}: the delay of {1e3 * delay:.3g} ms becomes {steps[-1]} steps of "
                f"{1e3 * step_s:g} ms, {1e3 * steps[-1] * step_s:.3g} ms"
            )
    return steps, lines


def servos_json(simulation: ServoSimulation, servos: Servos) -> str:
    """`servos.json`: the numbers that `servo_plugin.py` reads, SI units, one entry a joint."""
    entries = []
    for row, place in enumerate(simulation.joints):
        numbers = servos.of_joint(row)
        numbers["delay"] = max(float(servos.get("delay")[row]), 0.0)
        entries.append({"joint": simulation.arm.joints[place].name, **{key: numbers[key] for key in NUMBERS}})
    return json.dumps({"rate_hz": simulation.rate_hz, "servos": entries}, indent=2) + "\n"
