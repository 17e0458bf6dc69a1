"""Closed-loop simulation of the runs of a case: servos with an imperfect feed-forward follow a reference, at 8 kHz.

The semi-implicit Euler step of MuJoCo is a leapfrog: positions stand at the steps, velocities half a step before, and
the second difference of positions is exactly the acceleration of the torque at that step. Velocities are therefore
centred afterwards; without that, every viscous torque would seem late.

Effects without a place in the engine are torques that the motors give on top of what moves the mechanism. The inner
loops of the servos compensate their fast part at once; the slow part disturbs the motion, as computed on a coarser
pass. The recorded torque is the sum of what moves the mechanism and of the laws on the motion that was simulated.
Motion and torque therefore agree exactly.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np
from mujoco import rollout

from armlab.common.arrays import Array
from armlab.proof.blind.arms import with_parameters
from armlab.proof.blind.effects.hidden import HiddenEffect, smooth_sign
from armlab.proof.blind.engine import Mount, Parts, Plant, Track, build_plant
from armlab.proof.blind.motions import make_reference, moving_average
from armlab.proof.blind.plan import Plan, RunPlan
from armlab.proof.blind.sticking import is_carried, play_sticking
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.motion import Motion
from problem.regressor import observation_matrix, rigid_body_torque

FINE_HZ, COARSE_HZ = 8000, 2000
MARGIN_S = 0.25  # simulated before the first and after the last sample: the start dies away, intervals fit


@dataclass(frozen=True)
class ServoSettings:
    """The servos that a case draws; chosen by eye, in the range of industrial drives.

    bandwidth_hz, damping: ranges of the loop of each joint. model_error: range of the factors on the links that the
    feed-forward assumes. compensated: range of the share of the usual friction that the feed-forward makes up for.
    inner_loop_s: time within which the inner loops take up a change of friction.
    """

    bandwidth_hz: tuple[float, float] = (12, 25)
    damping: tuple[float, float] = (0.7, 1.1)
    model_error: tuple[float, float] = (0.9, 1.1)
    compensated: tuple[float, float] = (0.6, 0.95)
    inner_loop_s: float = 0.04


SERVOS = ServoSettings()


@dataclass(frozen=True, eq=False)
class Controller:
    """Servos and feed-forward: gains (joints,), and the arm that the feed-forward believes in.

    compensated: (joints,), share of the usual friction, the background, that the feed-forward makes up for.
    """

    position_gain: Array
    velocity_gain: Array
    model: Arm
    compensated: Array


@dataclass(frozen=True, eq=False)
class Reference:
    """What one run should do: positions (steps, joints) at `time` (steps,), margins included."""

    time: Array
    position: Array


def draw_controller(rng: np.random.Generator, nominal: Arm) -> Controller:
    """Servos with 12-25 Hz and a feed-forward whose links are off by up to a tenth."""
    bandwidth = 2 * np.pi * rng.uniform(*SERVOS.bandwidth_hz, len(nominal))
    damping = rng.uniform(*SERVOS.damping, len(nominal))
    inertia = mean_inertia(nominal)
    model = scale_links(nominal, rng.uniform(*SERVOS.model_error, len(nominal)))
    compensated = rng.uniform(*SERVOS.compensated, len(nominal))
    return Controller(inertia * bandwidth**2, 2 * damping * inertia * bandwidth, model, compensated)


def mean_inertia(arm: Arm, poses: int = 32) -> Array:
    """Inertia that each motor feels, mean over random poses, (joints,), kg m2."""
    position = np.random.default_rng(0).uniform(-1.5, 1.5, (poses, len(arm)))
    still, out = np.zeros_like(position), np.zeros(len(arm))
    rest = rigid_body_torque(arm, Motion(position, still, still))
    for joint in range(len(arm)):
        push = still.copy()
        push[:, joint] = 1.0
        out[joint] = np.mean((rigid_body_torque(arm, Motion(position, still, push)) - rest)[:, joint])
    return np.asarray(out + np.array(arm.rotor_inertia or [0.0] * len(arm)))


def scale_links(arm: Arm, factors: Array) -> Arm:
    """The arm with each link's inertial parameters times a factor."""
    return with_parameters(arm, arm.parameters * np.repeat(factors, 10))


def rigid_torque(arm: Arm, motion: Motion) -> Array:
    """Torque of links and rotors, (samples, joints), N m."""
    return rigid_body_torque(arm, motion) + rotor_torque(arm, motion)


def rotor_torque(arm: Arm, motion: Motion) -> Array:
    """Torque of the known rotors, (samples, joints), N m."""
    return np.asarray(np.array(arm.rotor_inertia or [0.0] * len(arm)) * motion.acceleration)


def run_times(length_s: float, rate_hz: int) -> Array:
    """Instants of a simulation with its margins; zero is the first sample."""
    steps = round((length_s + 2 * MARGIN_S) * rate_hz)
    return np.asarray(np.arange(steps + 1) / rate_hz - MARGIN_S)


def simulate(arm: Arm, parts: Parts, controller: Controller, reference: Reference, taken: Array) -> Track:
    """The run of an arm with hidden parts.

    taken: (steps, joints), N m, torque of the effects without a place in the engine, from an earlier, coarser pass.
    Raises FloatingPointError if the simulation diverges.
    """
    step = float(reference.time[1] - reference.time[0])
    made = build_plant(arm, parts, step, (controller.position_gain, controller.velocity_gain))
    control, wanted = servo_torques(controller, reference, taken)
    twists = _initial_twists(arm, parts, wanted)
    if parts.mount is not None:
        twists["mount"] = _settled_mount(made, parts.mount, wanted)
    states = _roll_out(made, wanted, control, twists)
    return _make_track(made, controller, reference.time, states, control)


def servo_torques(controller: Controller, reference: Reference, taken: Array) -> tuple[Array, Motion]:
    """What servos add to the torque of their gains, (steps, joints), N m, and the motion that they want.

    taken: (steps, joints), N m, torque of effects without a place in the engine; the inner loops take up its fast part.
    """
    step = float(reference.time[1] - reference.time[0])
    wanted = _differentiate_reference(reference.position, step)
    forward = rigid_torque(controller.model, wanted)
    gains = controller.position_gain * wanted.position + controller.velocity_gain * wanted.velocity
    width = round(SERVOS.inner_loop_s / step)
    return gains + forward - moving_average(moving_average(taken, width), width), wanted


def _differentiate_reference(position: Array, step: float) -> Motion:
    velocity = np.gradient(position, step, axis=0)
    return Motion(position, velocity, np.gradient(velocity, step, axis=0))


def _initial_twists(arm: Arm, parts: Parts, wanted: Motion) -> dict[str, float]:
    """Twist of each spring that carries the first load, rad, by name; without it the start would ring for seconds."""
    first = Motion(wanted.position[:1], wanted.velocity[:1], wanted.acceleration[:1])
    load = rigid_body_torque(arm, first)[0]
    return {f"spring{spring.joint}": spring.at_rest(float(load[spring.joint])) for spring in parts.springs}


def _settled_mount(made: Plant, mount: Mount, wanted: Motion) -> float:
    """Angle of a base, rad, whose spring carries the moment of the first state."""
    data = mujoco.MjData(made.model)
    data.qpos[made.places], data.qvel[made.dofs] = wanted.position[0], wanted.velocity[0]
    data.qacc[made.dofs] = wanted.acceleration[0]
    mujoco.mj_inverse(made.model, data)
    return -float(data.qfrc_inverse[made.model.joint("mount").dofadr[0]]) / mount.stiffness


def _roll_out(made: Plant, wanted: Motion, control: Array, twists: dict[str, float]) -> Array:
    """States (steps, time and positions and velocities) before each step."""
    data = mujoco.MjData(made.model)
    data.qpos[made.places], data.qvel[made.dofs] = wanted.position[0], wanted.velocity[0]
    for name, twist in twists.items():
        data.qpos[made.model.joint(name).qposadr[0]] = twist
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    first = np.empty(mujoco.mj_stateSize(made.model, kind))
    mujoco.mj_getState(made.model, data, first, kind)
    warnings, before = list[str](), mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(warnings.append)  # else the engine prints them, and logs them beside the user's files
    try:
        states, _ = rollout.rollout(made.model, [data], first[None], np.ascontiguousarray(control)[None])
    finally:
        mujoco.set_mju_user_warning(before)
    found = np.vstack([first, states[0]])
    if warnings or not np.all(np.isfinite(found)) or np.abs(found[:, 1:]).max() > 1e4:
        raise FloatingPointError(f"the simulated arm runs away at a step of {made.model.opt.timestep:g} s")
    return found


def _make_track(made: Plant, controller: Controller, time: Array, states: Array, control: Array) -> Track:
    nq = made.model.nq
    position, half = states[:, 1 + made.places], states[:, 1 + nq + made.dofs]
    step = float(time[1] - time[0])
    load = control - controller.position_gain * position[:-1] - controller.velocity_gain * half[:-1]
    motion = Motion(position[:-1], (half[1:] + half[:-1]) / 2, np.diff(half, axis=0) / step)
    return Track(time, motion, load)


@dataclass(frozen=True, eq=False)
class RunWithout:
    """A run as it is recorded without an effect, on the same motion.

    others: what else takes torque from the motors. run: its number. grid: (samples,), s; a recorded torque is the mean
    over the interval about its instant.
    """

    track: Track
    others: Sequence[HiddenEffect]
    run: int
    grid: Array

    @cached_property
    def centre(self) -> Array:
        """Instants of the samples, (samples, joints), s."""
        return np.repeat(self.grid[:, None], self.track.joints, axis=1)

    @cached_property
    def motor(self) -> Array:
        """Torque of the motors, (steps, joints), N m."""
        return self.track.load + law_torque(self.others, self.track, self.run)

    @cached_property
    def recorded(self) -> Array:
        """Their recorded torque, (samples, joints), N m."""
        return self.means(self.motor, self.centre)

    @cached_property
    def motion(self) -> Motion:
        """Motion at the samples."""
        return self.track.at(self.grid).motion

    def means(self, signal: Array, centre: Array) -> Array:
        """Mean of a signal (steps, joints) over the interval of a sample about each instant (samples, joints)."""
        return self.track.means(signal, centre, float(self.grid[1] - self.grid[0]))


def effect_torque(effect: HiddenEffect, arms: tuple[Arm, Arm], without: RunWithout) -> Array:
    """Recorded torque with the effect less what is recorded without it on the same motion.

    arms: with and without the effect. Returns (samples, joints), N m.
    """
    track, joints = without.track, without.track.joints
    added = np.zeros_like(track.load)
    law = effect.torque(track, without.run)
    if law is not None:
        added[:, effect.joint] += law
    if effect.has_parts:
        added += track.load - rigid_torque(arms[0], track.motion)
    share = without.means(added, without.centre)
    sampled = without.motion
    if arms[0] is not arms[1]:
        share += rigid_torque(arms[0], sampled) - rigid_torque(arms[1], sampled)
    shift, lag = effect.shift(joints), effect.lag(joints)
    if shift.any():
        shifted = Motion(sampled.position + shift, sampled.velocity, sampled.acceleration)
        share += rigid_torque(arms[0], sampled) - rigid_torque(arms[0], shifted)
    if lag.any():
        share += without.means(without.motor, without.centre - lag) - without.recorded
    return np.asarray(share + effect.read(without.recorded) - without.recorded)


def free_columns(arm: Arm, track: Track, grid: Array, friction_only: bool = False) -> Array:
    """Columns of Coulomb friction, viscous friction and offset of every joint, then of the base parameters.

    grid: (samples,), s; the sign of velocity is a mean over each interval, as the torque is. Returns (samples, joints,
    columns), N m per unit.
    """
    joints, samples = len(arm), len(grid)
    sampled, centre = track.at(grid), np.repeat(grid[:, None], len(arm), axis=1)
    signs = track.means(smooth_sign(track.velocity), centre, float(grid[1] - grid[0]))
    columns = np.zeros((samples, joints, 3 * joints))
    for joint in range(joints):
        columns[:, joint, joint] = signs[:, joint]
        columns[:, joint, joints + joint] = sampled.velocity[:, joint]
        columns[:, joint, 2 * joints + joint] = 1.0
    if friction_only:
        return columns
    rigid = observation_matrix(arm, sampled.motion)[:, base_parameters(arm).columns]
    return np.concatenate([columns, rigid.reshape(samples, joints, -1)], axis=2)


def absorbed_rotors(arm: Arm) -> list[int]:
    """Joints (from 0) whose rotor no motion separates from the links."""
    states = np.random.default_rng(0).uniform(-2, 2, (3, 200, len(arm)))
    motion = Motion(*states)
    rigid = observation_matrix(arm, motion)[:, base_parameters(arm).columns]
    out = []
    for joint in range(len(arm)):
        column = np.zeros((200, len(arm)))
        column[:, joint] = motion.acceleration[:, joint]
        rest = column.ravel() - rigid @ np.linalg.lstsq(rigid, column.ravel(), rcond=None)[0]
        if np.linalg.norm(rest) < 1e-6 * np.linalg.norm(column):
            out.append(joint)
    return out


def law_torque(effects: Sequence[HiddenEffect], track: Track, run: int) -> Array:
    """Torque that laws take from the motors, (steps, joints), N m."""
    out = np.zeros_like(track.load)
    for effect in effects:
        law = effect.torque(track, run)
        if law is not None:
            out[:, effect.joint] += law
    return out


def reference_track(plan: Plan, number: int, run: RunPlan) -> Track:
    """The reference of the run of that number, as a track of the arm without hidden effects."""
    time = run_times(run.length_s, FINE_HZ)
    return track_reference(plan, time, make_reference(run.family, plan.stream(f"motion {number}"), time, plan.machine))


def track_reference(plan: Plan, time: Array, position: Array) -> Track:
    """Positions (steps, joints) at even instants, as a track of the arm without hidden effects."""
    motion = _differentiate_reference(position, float(time[1] - time[0]))
    return Track(time, motion, rigid_torque(plan.true_arm, motion))


def arm_with_effects(plan: Plan, hidden: Sequence[HiddenEffect]) -> Arm:
    """The arm with links that are off and with the hidden bodies."""
    arm = plan.true_arm
    for effect in hidden:
        arm = effect.arm(arm)
    return arm


def simulate_runs(
    plan: Plan, hidden: Sequence[HiddenEffect], controller: Controller, before: Sequence[Track], wanted: Sequence[Track]
) -> tuple[Track, ...]:
    """Simulates all runs at the step of the wanted tracks, with the torque of the laws on the tracks before."""
    arm, usual = arm_with_effects(plan, hidden), 1 - controller.compensated
    parts = sum((effect.parts() for effect in hidden), Parts())
    out = []
    for run, (goal, track) in enumerate(zip(wanted, before, strict=True)):
        known = track.at(goal.time)
        if plan.engine == "sticking":
            out.append(_play_sticking(plan, hidden, controller, arm, run, goal, known))
            continue
        disturbing = usual * law_torque(plan.background, known, run) + law_torque(hidden, known, run)
        out.append(simulate(arm, parts, controller, Reference(goal.time, goal.position), disturbing))
    return tuple(out)


def _play_sticking(
    plan: Plan,
    hidden: Sequence[HiddenEffect],
    controller: Controller,
    arm: Arm,
    run: int,
    goal: Track,
    known: Track,
) -> Track:
    """A run in the second engine. known: the same run as simulated before, at the instants of the wanted track."""
    usual, carried = plan.background, [each for each in (*plan.background, *hidden) if is_carried(each)]
    taken = (1 - controller.compensated) * law_torque([each for each in usual if not is_carried(each)], known, run)
    taken += law_torque([each for each in hidden if not is_carried(each)], known, run)
    ready = controller.compensated * law_torque([each for each in usual if is_carried(each)], goal, run)
    given, wanted = servo_torques(controller, Reference(goal.time, goal.position), taken)
    gains = controller.position_gain, controller.velocity_gain
    return play_sticking(arm, gains, goal.time, given + ready, wanted, carried)


def coarse_track(track: Track) -> Track:
    """A track at the step of the coarse pass."""
    every = slice(None, None, FINE_HZ // COARSE_HZ)
    motion = Motion(track.position[every], track.velocity[every], track.acceleration[every])
    return Track(track.time[every], motion, track.load[every])
