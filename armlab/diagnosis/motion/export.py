"""The servos of a diagnosis as files of simulators: MJCF, Isaac Lab, mjlab; with what their fields cannot express.

MJCF: kp and kv in the actuator, limit as its forcerange, delay as its delay (with a buffer of commands), damping,
friction and armature in the joint. kv is that of the simulation, or 0 where damping outside the force range explains
the motion better. The friction loss gets a `solimpfriction` that sticks: with MuJoCo's own a loaded joint creeps.
"""

import math
from collections.abc import Iterator

import numpy as np

from armlab.common.errors import InputError
from armlab.diagnosis.motion.replay import STICKING
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, Servos
from armlab.diagnosis.motion.simulation import ServoSimulation
from problem.mjcf import import_mujoco


def mjcf_text(simulation: ServoSimulation, servos: Servos) -> str:
    """The simulation with the numbers of servos, as MJCF; paths of meshes are made absolute.

    Raises InputError where MuJoCo cannot write the model.
    """
    mujoco = import_mujoco()
    spec = simulation.spec()
    names = {actuator.target: actuator for actuator in spec.actuators}
    for row, place in enumerate(simulation.joints):
        joint = spec.joint(simulation.arm.joints[place].name)
        joint.damping[0], joint.armature = float(servos.get("damping")[row]), float(servos.get("armature")[row])
        joint.frictionloss = float(servos.get("friction")[row])
        joint.solimp_friction = list(STICKING)
        actuator = names[joint.name]
        actuator.set_to_position(kp=float(servos.get("kp")[row]), kv=float(servos.get("kd")[row]))
        limit = float(servos.get("limit")[row])
        actuator.forcelimited = limit < INFINITE_LIMIT
        actuator.forcerange = [-limit, limit]
        delay = float(servos.get("delay")[row])
        if delay > 0:
            actuator.delay = delay
            actuator.nsample = math.ceil(delay / spec.option.timestep) + 1
    if simulation.path.suffix == ".xml":
        folder = simulation.path.parent.resolve()
        spec.meshdir, spec.texturedir = str(folder / spec.meshdir), str(folder / spec.texturedir)
    try:
        spec.compile()
        return str(spec.to_xml())
    except (ValueError, mujoco.FatalError) as error:
        raise InputError(f"MuJoCo cannot write {simulation.path.name}: {' '.join(str(error).split())}") from None


def missing_in_mjcf(simulation: ServoSimulation, servos: Servos) -> Iterator[str]:
    """What MJCF has no field for, one line a number."""
    for row, place in enumerate(simulation.joints):
        name = simulation.arm.joints[place].name
        offset, band = float(servos.get("offset")[row]), float(servos.get("dead_band")[row])
        share, delay = float(servos.get("load_friction")[row]), float(servos.get("delay")[row])
        if offset:
            yield f"{name}: add {offset:.4g} rad to the command (command offset)"
        if band:
            yield f"{name}: send the position itself where |command - position| is below {band / 2:.4g} rad (dead band)"
        if share:
            yield f"{name}: at each step add {share:.4g} |qfrc_bias| to frictionloss (friction that grows with load)"
        if delay < 0:
            yield f"{name}: the position was read {-1e3 * delay:.3g} ms after its stamp (no field is needed)"
    if simulation.supply is not None:
        yield f"kp and forcerange hold at {simulation.supply:g} V: scale both with the supply voltage"


def isaac_lab_text(simulation: ServoSimulation, servos: Servos, step_s: float) -> str:
    """Actuators for Isaac Lab (`DelayedPDActuatorCfg`): N m/rad, N m s/rad, N m, kg m2, delays in physics steps.

    Fields as in isaaclab.actuators v2.3.2. Its effort limit holds for the whole PD law, so kd is its `damping` and the
    joint's own damping its `viscous_friction`. step_s: of the physics, s.
    """
    lines = ["# Isaac Lab: put into ArticulationCfg(actuators={...}); delays are steps of the physics", "{"]
    for row, place in enumerate(simulation.joints):
        delay = max(round(float(servos.get("delay")[row]) / step_s), 0)
        fields = {
            "joint_names_expr": repr([simulation.arm.joints[place].name]),
            "stiffness": f"{servos.get('kp')[row]:.6g}",
            "damping": f"{servos.get('kd')[row]:.6g}",
            "effort_limit": _limit(servos, row),
            "armature": f"{servos.get('armature')[row]:.6g}",
            "friction": f"{servos.get('friction')[row]:.6g}",
            "dynamic_friction": f"{servos.get('friction')[row]:.6g}",
            "viscous_friction": f"{servos.get('damping')[row]:.6g}",
            "min_delay": str(delay),
            "max_delay": str(delay),
        }
        inner = ", ".join(f"{name}={value}" for name, value in fields.items())
        lines.append(f'    "{simulation.arm.joints[place].name}": DelayedPDActuatorCfg({inner}),')
    return "\n".join([*lines, "}", ""])


def mjlab_text(simulation: ServoSimulation, servos: Servos, step_s: float) -> str:
    """Actuators for mjlab (`BuiltinPositionActuatorCfg` of v1.6): delays in physics steps; step_s: of the physics, s.

    mjlab's damping becomes kv, inside the force limit; the joint's own damping stays in the MJCF of the verdict.
    """
    lines = ["# mjlab: EntityArticulationInfoCfg(actuators=(...)), with the joints of simulation.xml", "("]
    for row, place in enumerate(simulation.joints):
        delay = max(round(float(servos.get("delay")[row]) / step_s), 0)
        fields = {
            "target_names_expr": f"({simulation.arm.joints[place].name!r},)",
            "stiffness": f"{servos.get('kp')[row]:.6g}",
            "damping": f"{servos.get('kd')[row]:.6g}",
            "effort_limit": _limit(servos, row),
            "armature": f"{servos.get('armature')[row]:.6g}",
            "frictionloss": f"{servos.get('friction')[row]:.6g}",
            "delay_min_lag": str(delay),
            "delay_max_lag": str(delay),
        }
        inner = ", ".join(f"{name}={value}" for name, value in fields.items())
        lines.append(f"    BuiltinPositionActuatorCfg({inner}),")
    return "\n".join([*lines, ")", ""])


def _limit(servos: Servos, row: int) -> str:
    limit = float(servos.get("limit")[row])
    return f"{limit:.6g}" if np.isfinite(limit) and limit < INFINITE_LIMIT else "None"
