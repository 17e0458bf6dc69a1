"""The servos of a diagnosis as actuators of Isaac Lab and mjlab: Python files, with the numbers and what they lack.

Isaac Lab (isaaclab 2.3.2, `actuators/actuator_base_cfg.py`, `actuator_pd.py`) computes for a `DelayedPDActuatorCfg`

    torque = clip(stiffness (q* - q) + damping (qd* - qd) + feedforward, -effort_limit, effort_limit)

with commands min_delay to max_delay steps of the physics late; friction, dynamic_friction (N m since Isaac Sim 5.0),
viscous_friction and armature belong to the joint. mjlab (mjlab 1.6.0, `actuator/builtin_actuator.py`) makes a position
actuator of MuJoCo of a `BuiltinPositionActuatorCfg`: kp is its stiffness, kv its damping, forcerange its effort_limit,
and the joint's damping its viscous_damping. In both, damping is the gain kd of the law, inside the torque limit.
"""

from collections.abc import Iterable, Sequence

from armlab.diagnosis.motion.export import delay_steps, lines_without_field
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, Servos
from armlab.diagnosis.motion.servo_simulation import ServoSimulation

UNITS = (
    "Units: stiffness N m/rad, damping N m s/rad, effort_limit and friction N m, armature kg m2 (N/m, N s/m, N, kg",
    "for sliding joints).",
)
UNLIMITED_EFFORT = 1e9  # N m: what Isaac Lab itself takes for no limit of an explicit actuator


def isaac_lab_text(simulation: ServoSimulation, servos: Servos, step_s: float) -> str:
    """`isaaclab_actuators.py`: ACTUATORS for ArticulationCfg(actuators=ACTUATORS). step_s: of the physics, s."""
    steps, rounded = delay_steps(simulation, servos, step_s)
    blocks = []
    for row, place in enumerate(simulation.joints):
        name = simulation.arm.joints[place].name
        limit = min(float(servos.get("limit")[row]), UNLIMITED_EFFORT)
        fields = {
            "joint_names_expr": [name],
            "stiffness": servos.get("kp")[row],
            "damping": servos.get("kd")[row],
            "effort_limit": limit if limit < INFINITE_LIMIT else UNLIMITED_EFFORT,
            "armature": servos.get("armature")[row],
            "friction": servos.get("friction")[row],
            "dynamic_friction": servos.get("friction")[row],
            "viscous_friction": servos.get("damping")[row],
            "min_delay": steps[row],
            "max_delay": steps[row],
        }
        blocks.append(_block(f"{name!r}: DelayedPDActuatorCfg", fields))
    head = _comment(
        [
            "Actuators for Isaac Lab 2.3.2 on Isaac Sim 5.0 or later, written by armlab from a recording of motion.",
            "Use: ArticulationCfg(..., actuators=ACTUATORS). An actuator gets the joint's position target; leave the",
            "velocity target and the effort target at zero.",
            *UNITS,
            f"Delays: steps of the physics, SimulationCfg(dt={step_s:g}); with another dt they are other numbers.",
            "damping is kd, inside the effort limit; the joint's own damping is viscous_friction.",
            "Isaac Sim 4.5 reads friction as a factor of the joint's load: these numbers are torques.",
        ],
        [
            *rounded,
            "stiffness and damping act explicitly: stable where damping dt, stiffness dt^2 are small against inertia",
            *lines_without_field(simulation, servos),
        ],
    )
    return "\n".join(
        [head, "from isaaclab.actuators import DelayedPDActuatorCfg", "", "ACTUATORS = {", *blocks, "}", ""]
    )


def mjlab_text(simulation: ServoSimulation, servos: Servos, step_s: float) -> str:
    """`mjlab_actuators.py`: ARTICULATION and `make_spec` for EntityCfg. step_s: of the physics, s."""
    steps, rounded = delay_steps(simulation, servos, step_s)
    blocks = []
    for row, place in enumerate(simulation.joints):
        limit = float(servos.get("limit")[row])
        fields = {
            "target_names_expr": (simulation.arm.joints[place].name,),
            "stiffness": servos.get("kp")[row],
            "damping": servos.get("kd")[row],
            "effort_limit": limit if limit < INFINITE_LIMIT else None,
            "armature": servos.get("armature")[row],
            "frictionloss": servos.get("friction")[row],
            "viscous_damping": servos.get("damping")[row],
            "delay_min_lag": steps[row],
            "delay_max_lag": steps[row],
        }
        blocks.append(_block("BuiltinPositionActuatorCfg", fields, "        "))
    head = _comment(
        [
            "Actuators for mjlab 1.6.0, written by armlab from a recording of motion.",
            "Use: EntityCfg(spec_fn=make_spec, articulation=ARTICULATION); simulation.xml stands beside this file.",
            *UNITS,
            f"Delays: steps of the physics of {step_s:g} s (MujocoCfg(timestep={step_s:g})).",
            "damping is kv, inside the force limit; the joint's own damping is viscous_damping.",
        ],
        [*rounded, *lines_without_field(simulation, servos)],
    )
    code = [
        "from pathlib import Path",
        "",
        "import mujoco",
        "from mjlab.actuator import BuiltinPositionActuatorCfg",
        "from mjlab.entity import EntityArticulationInfoCfg",
        "",
        "",
        "def make_spec() -> mujoco.MjSpec:",
        '    """The robot without the actuators of its file: mjlab adds those below."""',
        '    spec = mujoco.MjSpec.from_file(str(Path(__file__).parent / "simulation.xml"))',
        "    for actuator in list(spec.actuators):",
        "        spec.delete(actuator)",
        "    return spec",
        "",
        "",
        "ARTICULATION = EntityArticulationInfoCfg(",
        "    actuators=(",
        *blocks,
        "    )",
        ")",
        "",
    ]
    return "\n".join([head, *code])


def _block(call: str, fields: dict[str, object], indent: str = "    ") -> str:
    lines = [f"{indent}    {name}={_literal(value)}," for name, value in fields.items()]
    return "\n".join([f"{indent}{call}(", *lines, f"{indent}),"])


def _literal(value: object) -> str:
    return f"{value:.6g}" if isinstance(value, float) else repr(value)


def _comment(lines: Sequence[str], missing: Iterable[str]) -> str:
    """The head of a file, with what its fields do not hold."""
    listed = list(missing) or ["nothing"]
    text = [*lines, "", "What these fields do not hold:", *(f"- {line}" for line in listed)]
    return "\n".join([*(f"# {line}".rstrip() for line in text), ""])
