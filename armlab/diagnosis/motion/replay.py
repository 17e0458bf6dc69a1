"""Closed-loop replay in MuJoCo: the recorded commands through a whole simulated arm, beside the measured motion."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.motion.servo import Key, Servos
from armlab.diagnosis.motion.servo_plugin import STICKING, set_fields
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, actuator_of
from armlab.diagnosis.motion.windows import held_command, smooth_motion, supply_factor
from armlab.recordings.recording import MotionRun
from problem.mjcf import import_mujoco

BEYOND_FIELDS: tuple[Key, ...] = ("limit_slope", "dead_band", "load_friction", "static_excess", "ki")  # of MuJoCo


@dataclass(frozen=True, eq=False)
class Replayed:
    """One run: position as simulated, (samples, joints), rad, and the distance of the tools, (samples,), m."""

    run: MotionRun
    position: Array
    tool_distance: Array

    @property
    def error(self) -> Array:
        """Simulated minus measured, (samples, joints), rad."""
        return np.asarray(self.position - self.run.position)


def with_servos(model: Any, simulation: ServoSimulation, servos: Servos) -> Any:
    """The model with the numbers of servos in its fields: gain and force range of the actuators, fields of the joints.

    What a model of MuJoCo has no field for, `replay` adds step by step (`_needs_steps`). The friction loss sticks.
    """
    for row, joint in enumerate(simulation.joints):
        set_fields(model, joint, actuator_of(model, joint), servos.of_joint(row))
    return model


def replay(
    simulation: ServoSimulation, servos: Servos | None, runs: Sequence[MotionRun], finer: int = 1
) -> list[Replayed]:
    """The runs sent through the simulation, each from its first measured state.

    servos: in place of the simulation's numbers; None for the simulation as it is given. Contact, joint limits and
    limits of the command are off: only drives and inertias are compared. Joints that were not recorded are held at
    zero. finer: steps within one of the simulation.
    """
    if servos is None and not simulation.as_given:
        servos = simulation.nominal
    model = _free_model(simulation, servos)
    model.opt.timestep /= finer
    return [_replay_run(model, simulation, servos, run) for run in runs]


def _free_model(simulation: ServoSimulation, servos: Servos | None) -> Any:
    """The model with servos, without contact, joint limits and limits of the command."""
    model = simulation.model()
    if servos is not None:
        model = with_servos(model, simulation, servos)
    flags = import_mujoco().mjtDisableBit
    model.opt.disableflags |= int(flags.mjDSBL_LIMIT) | int(flags.mjDSBL_CONTACT) | int(flags.mjDSBL_CLAMPCTRL)
    _hold_others(model, simulation)
    return model


def _hold_others(model: Any, simulation: ServoSimulation) -> None:
    """Joints that were not recorded get a friction that nothing overcomes: they stay where they start."""
    for joint in set(range(model.nv)) - set(simulation.joints):
        model.dof_frictionloss[joint] = 1e3
        model.dof_solimp[joint] = STICKING


def _replay_run(model: Any, simulation: ServoSimulation, servos: Servos | None, run: MotionRun) -> Replayed:
    joints, path = list(simulation.joints), _path(model, simulation, servos, run)
    time = run.time[0] + model.opt.timestep * np.arange(len(path))
    read = zip(joints, simulation.read_delay.tolist(), strict=True)
    position = np.stack([np.interp(run.time + late, time, path[:, joint]) for joint, late in read], axis=1)
    distance = np.linalg.norm(
        tool_positions(model, joints, position) - tool_positions(model, joints, run.position), axis=1
    )
    return Replayed(run, position, distance)


def _path(model: Any, simulation: ServoSimulation, servos: Servos | None, run: MotionRun) -> Array:
    """Positions (steps, joints) of all joints at each step from the first measured state on."""
    mujoco = import_mujoco()
    data = mujoco.MjData(model)
    joints = list(simulation.joints)
    last = run.time[-1] + float(simulation.read_delay.max())
    steps = int(np.ceil((last - run.time[0]) / model.opt.timestep)) + 1
    time = run.time[0] + model.opt.timestep * np.arange(steps)
    data.qpos[joints] = run.position[0]
    data.qvel[joints] = smooth_motion(run, simulation.read_delay).velocity[0]
    mujoco.mj_forward(model, data)
    control = np.zeros((steps, model.nu))
    for row, joint in enumerate(joints):
        delay = 0.0 if servos is None else float(servos.get("delay")[row])
        offset = 0.0 if servos is None else float(servos.get("offset")[row])
        control[:, actuator_of(model, joint)] = held_command(run, row, time - delay, simulation.rate_hz) + offset
    if servos is not None and _needs_steps(simulation, servos, run):
        return _step_through(model, data, simulation, servos, run, control)
    return _roll_out(model, data, control)


def _needs_steps(simulation: ServoSimulation, servos: Servos, run: MotionRun) -> bool:
    """Whether the law has parts that no field of MuJoCo holds."""
    parts = [servos.get(key) for key in BEYOND_FIELDS]
    return any(part.any() for part in parts) or (simulation.supply is not None and run.voltage is not None)


def _roll_out(model: Any, data: Any, control: Array) -> Array:
    """Positions (steps, joints) of all joints at the beginning of each step, by MuJoCo's own loop."""
    from mujoco import rollout

    mujoco = import_mujoco()
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.empty(mujoco.mj_stateSize(model, kind))
    mujoco.mj_getState(model, data, state, kind)
    states, _ = rollout.rollout(model, data, state[None], control[None, :-1])
    return np.concatenate([state[None, 1 : 1 + model.nq], states[0, :, 1 : 1 + model.nq]])


def _step_through(
    model: Any, data: Any, simulation: ServoSimulation, servos: Servos, run: MotionRun, control: Array
) -> Array:
    """The same step by step, with what no field holds, and the supply voltage.

    Friction follows the velocity and the load as the plug-in finds them within the step before.
    """
    mujoco = import_mujoco()
    joints = np.array(simulation.joints)
    actuators = np.array([actuator_of(model, joint) for joint in simulation.joints])
    half, share, level = servos.get("dead_band") / 2, servos.get("load_friction"), servos.get("friction")
    excess, speed, velocity = servos.get("static_excess"), servos.get("stribeck_speed"), data.qvel.copy()
    limit, slope, kp, kd = (servos.get(key) for key in ("limit", "limit_slope", "kp", "kd"))
    wound_up, gain = servos.get("integral_limit"), servos.get("ki") * model.opt.timestep
    of_speed = servos.get("ki_speed")
    integral = _resting_integral(data, simulation, servos, control[0][actuators])
    time = run.time[0] + model.opt.timestep * np.arange(len(control))
    factors = [supply_factor(run, row, time, simulation.supply) for row in range(len(joints))]
    supplies = [(row, factor) for row, factor in enumerate(factors) if factor is not None]
    varies, has_dead_band, falls = bool(share.any() or excess.any()), bool(half.any()), bool(slope.any())
    path = np.empty((len(control), model.nq))
    position, bias, asked = data.qpos, data.qfrc_bias, data.ctrl  # views of what MuJoCo computes
    pushed, earlier = np.zeros(model.nv), np.zeros(model.nv)
    for number, command in enumerate(control[:, actuators]):
        path[number] = position
        now = position[joints]
        error = command - now
        if has_dead_band:
            error -= np.minimum(np.maximum(error, -half), half)
        more = gain * error - of_speed * model.opt.timestep * data.qvel[joints]
        integral = np.minimum(np.maximum(integral + more, -wound_up), wound_up)
        asked[actuators] = now + ((kp - of_speed) * error + integral) / kp
        if varies:
            mujoco.mj_mulM(model, data, pushed, earlier)
            carried = bias + pushed - model.dof_armature * earlier
            static = excess * np.exp(-((velocity[joints] / speed) ** 2))
            model.dof_frictionloss[joints] = level + static + share * np.abs(carried[joints])
            earlier, velocity = data.qacc * (number > 0), data.qvel.copy()
        if falls:
            swift = slope * data.qvel[joints]
            model.actuator_forcerange[actuators, 0] = -np.maximum(limit + np.minimum(swift, 0.0), 0.0)
            model.actuator_forcerange[actuators, 1] = np.maximum(limit - np.maximum(swift, 0.0), 0.0)
        for row, factor in supplies:
            scaled = factor[number] * np.array([-kp[row], -kd[row]])
            model.actuator_gainprm[actuators[row], 0] = -scaled[0]
            model.actuator_biasprm[actuators[row], 1:3] = scaled
            most = model.actuator_forcerange[actuators[row]] if falls else limit[row] * np.array([-1.0, 1.0])
            model.actuator_forcerange[actuators[row]] = factor[number] * most
        mujoco.mj_step(model, data)
    return path


def _resting_integral(data: Any, simulation: ServoSimulation, servos: Servos, command: Array) -> Array:
    """What the integrals hold at the first sample, (joints,), N m: the drives carry the weight of the arm."""
    joints, wound_up = list(simulation.joints), servos.get("integral_limit")
    gain = servos.get("kp") - servos.get("ki_speed")
    held = data.qfrc_bias[joints] - gain * (command - data.qpos[joints])
    return np.asarray(np.where(servos.get("ki") > 0, np.clip(held, -wound_up, wound_up), 0.0))


def tool_positions(model: Any, joints: Sequence[int], position: Array) -> Array:
    """Place (samples, 3) of the tool, m: the model's last site, or the frame of its last body without sites."""
    mujoco = import_mujoco()
    data = mujoco.MjData(model)
    places = np.empty((len(position), 3))
    for number, row in enumerate(position):
        data.qpos[list(joints)] = row
        mujoco.mj_kinematics(model, data)
        places[number] = data.site_xpos[-1] if model.nsite else data.xpos[-1]
    return places


def joint_rms(replayed: Sequence[Replayed]) -> Array:
    """Error of each joint over all runs, (joints,), rad."""
    errors = np.concatenate([each.error for each in replayed])
    return np.asarray(np.sqrt(np.mean(errors**2, axis=0)))


def tool_rms(replayed: Sequence[Replayed]) -> float:
    """Distance of the tools over all runs, root mean square, m."""
    return float(np.sqrt(np.mean(np.concatenate([each.tool_distance for each in replayed]) ** 2)))
