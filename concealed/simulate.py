"""Closed-loop simulation: servos with an imperfect feed-forward follow a reference, at 8 kHz in C.

MuJoCo's semi-implicit Euler step is a leapfrog: positions stand at the steps, velocities half a step before,
and the second difference of positions is exactly the acceleration of the torque at that step. Velocities are
therefore centred afterwards; without that, every viscous torque would seem late.

Effects without a place in the engine are torques that the motors give on top of what moves the mechanism. The
servos' inner loops take up their fast part at once; the slow part disturbs the motion, as it was on a coarser pass.
The recorded torque is the sum of what moves the mechanism and of the laws on the very motion that came about, so
motion and torque fit exactly, however the servos shared the work.
"""

from dataclasses import dataclass

import mujoco
import numpy as np
from mujoco import rollout

from concealed.bodies import with_parameters
from concealed.engine import Parts, Plant, plant
from concealed.motions import boxed
from concealed.track import Track
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from recordings.run import Array

FINE_HZ, COARSE_HZ = 8000, 2000
INNER_LOOP_S = 0.04  # time within which the inner loops take up a change of friction
MARGIN_S = 0.25  # simulated before the first and after the last sample: the start dies away, intervals fit


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
    bandwidth = 2 * np.pi * rng.uniform(12, 25, len(nominal))
    damping = rng.uniform(0.7, 1.1, len(nominal))
    inertia = mean_inertia(nominal)
    model = nominal_scaled(nominal, rng.uniform(0.9, 1.1, len(nominal)))
    compensated = rng.uniform(0.6, 0.95, len(nominal))
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


def nominal_scaled(arm: Arm, factors: Array) -> Arm:
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

    taken: (steps, joints), N m, torque that effects without a place in the engine take from the motors: as it
    was on an earlier, coarser pass.
    Raises FloatingPointError if the simulation runs away.
    """
    step = float(reference.time[1] - reference.time[0])
    made = plant(arm, parts, step, (controller.position_gain, controller.velocity_gain))
    wanted = Motion(reference.position, *_derivatives(reference.position, step))
    forward = rigid_torque(controller.model, wanted)
    gains = controller.position_gain * wanted.position + controller.velocity_gain * wanted.velocity
    width = round(INNER_LOOP_S / step)
    control = gains + forward - boxed(boxed(taken, width), width)
    states = _rolled(made, wanted, control, _twists(arm, parts, wanted))
    return _track(made, controller, reference.time, states, control)


def _derivatives(position: Array, step: float) -> tuple[Array, Array]:
    velocity = np.gradient(position, step, axis=0)
    return velocity, np.gradient(velocity, step, axis=0)


def _twists(arm: Arm, parts: Parts, wanted: Motion) -> dict[str, float]:
    """Springs by name with the twist that carries the first load: a start without it would ring for seconds."""
    first = Motion(wanted.position[:1], wanted.velocity[:1], wanted.acceleration[:1])
    load = rigid_body_torque(arm, first)[0]
    return {f"spring{spring.joint}": spring.at_rest(float(load[spring.joint])) for spring in parts.springs}


def _rolled(made: Plant, wanted: Motion, control: Array, twists: dict[str, float]) -> Array:
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


def _track(made: Plant, controller: Controller, time: Array, states: Array, control: Array) -> Track:
    nq = made.model.nq
    position, half = states[:, 1 + made.places], states[:, 1 + nq + made.dofs]
    step = float(time[1] - time[0])
    load = control - controller.position_gain * position[:-1] - controller.velocity_gain * half[:-1]
    motion = Motion(position[:-1], (half[1:] + half[:-1]) / 2, np.diff(half, axis=0) / step)
    return Track(time, motion, load)
