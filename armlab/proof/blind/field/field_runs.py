"""The runs of a field case by inverse dynamics: the motion is given, and torque follows from it.

The links move as planned. Behind a soft drive or a play the motor moves differently, which the torque of the links
says (a flat system; Fliess 1995): q_motor = q_link + twist tau_link + gap / 2 tanh(tau_link / w). Encoders are at the
motors. Torque and motion agree to within rounding, however hard friction and rest are to integrate.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.engine import Track
from armlab.proof.blind.field.field_hidden import FieldEffect
from armlab.proof.blind.field.field_motions import field_motion
from armlab.proof.blind.field.field_plan import Drive, FieldPlan
from armlab.proof.blind.field.rest import RestRun
from armlab.proof.blind.plan import RunPlan
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque

INNER_HZ = 1000  # at least: a motion of 16 Hz and less is smooth there
CROSSING = 0.3  # of the spread of a joint's torque, in which its play is crossed


@dataclass(frozen=True, eq=False)
class FieldRun:
    """One run at the inner rate, all (steps, joints). track: of the motors. friction, rest, laws: torque that the
    motors give on top of the load, the last one for hidden effects."""

    plan: RunPlan
    track: Track
    friction: Array
    rest: Array
    laws: Array

    @property
    def torque(self) -> Array:
        """Of the motors, N m."""
        return np.asarray(self.track.load + self.friction + self.rest + self.laws)


@dataclass(frozen=True, eq=False)
class FieldCase:
    """A simulated recording. arm: links as they are, with what is hidden. rest_factors: of each joint, as scaled."""

    plan: FieldPlan
    hidden: tuple[FieldEffect, ...]
    arm: Arm
    runs: tuple[FieldRun, ...]
    rest_factors: tuple[Array, ...]

    @cached_property
    def spread(self) -> Array:
        """Standard deviation of the torque of each joint without what is hidden, (joints,), N m."""
        return np.asarray(np.std(np.concatenate([run.torque - run.laws for run in self.runs]), axis=0))

    @property
    def channels(self) -> tuple[HiddenEffect, ...]:
        """Hidden effects that have a law of the library."""
        return tuple(each.law for each in self.hidden if each.law is not None)

    @cached_property
    def lag(self) -> Array:
        """How much later each torque channel is than the motion, (joints,), s."""
        joints = len(self.arm)
        return np.asarray(np.sum([each.lag(joints) for each in self.channels] or [np.zeros(joints)], axis=0))

    @cached_property
    def shift(self) -> Array:
        """What hidden effects add to each position channel, (joints,), rad."""
        joints = len(self.arm)
        return np.asarray(np.sum([each.shift(joints) for each in self.channels] or [np.zeros(joints)], axis=0))

    def late(self, time: Array, torque: Array) -> Array:
        """Torque (steps, joints) as channels that are late show it."""
        if not self.lag.any():
            return torque
        return np.column_stack(
            [np.interp(time - self.lag[joint], time, column) for joint, column in enumerate(torque.T)]
        )

    def read(self, torque: Array) -> Array:
        """Torque (samples, joints) as the channels read it: gains, offsets, faults that are hidden."""
        drives = self.plan.drives
        read = torque * [drive.gain for drive in drives] + [drive.offset for drive in drives]
        for effect in self.channels:
            read = effect.read(read)
        return np.asarray(read)


def simulate_field(
    plan: FieldPlan, hidden: Sequence[FieldEffect] = (), rest_factors: tuple[Array, ...] | None = None
) -> FieldCase:
    """The runs of a plan with hidden effects.

    rest_factors: of another recording of the same robot; found from the torque of these runs if left out.
    """
    changed = plan
    for effect in hidden:
        changed = effect.in_plan(changed)
    arm = changed.true_arm
    for effect in hidden:
        arm = effect.law.arm(arm) if effect.law else arm
    tracks = [_motor_track(changed, arm, time, motion) for time, motion in _planned_motions(changed)]
    usual = [_friction(plan, track) for track in tracks]
    columns = [_rest_columns(plan, number, track) for number, track in enumerate(tracks)]
    if rest_factors is None:
        torque = np.concatenate([track.load + own for track, own in zip(tracks, usual, strict=True)])
        rest_factors = tuple(
            each.factors(np.concatenate([run[joint] for run in columns]), torque[:, joint])
            for joint, each in enumerate(plan.rest)
        )
    runs = []
    for number, track in enumerate(tracks):
        rest = np.column_stack([own @ factors for own, factors in zip(columns[number], rest_factors, strict=True)])
        laws = _friction(changed, track) - usual[number]
        for effect in hidden:
            laws = laws + effect.torque(track, number)
        runs.append(FieldRun(plan.runs[number], track, usual[number], rest, laws))
    return FieldCase(changed, tuple(hidden), arm, tuple(runs), rest_factors)


def on_same_motion(base: FieldCase, effect: FieldEffect) -> FieldCase:
    """A case with one more effect on the motion that it has: what an effect adds is the difference to it."""
    plan = effect.in_plan(base.plan)
    arm = effect.law.arm(base.arm) if effect.law else base.arm
    runs = []
    for number, run in enumerate(base.runs):
        track, laws = run.track, run.laws + effect.torque(run.track, number)
        if effect.number and plan.friction != base.plan.friction and effect.place is not None:
            joint = effect.place - 1
            before, after = (each.friction[joint].torque(track, joint) for each in (base.plan, plan))
            laws[:, joint] += after - before
        if arm is not base.arm:
            more = rigid_body_torque(arm, track.motion) - rigid_body_torque(base.arm, track.motion)
            track = Track(track.time, track.motion, track.load + more)
        runs.append(FieldRun(run.plan, track, run.friction, run.rest, laws))
    return FieldCase(plan, (*base.hidden, effect), arm, tuple(runs), base.rest_factors)


def inner_rate_hz(plan: FieldPlan) -> int:
    """A multiple of the rate of the recording."""
    return plan.log.rate_hz * int(np.ceil(INNER_HZ / plan.log.rate_hz))


def _planned_motions(plan: FieldPlan) -> list[tuple[Array, Motion]]:
    """Time and motion of the links of each run; pieces of one motion where the plan cuts."""
    rate, still = inner_rate_hz(plan), np.array(plan.still)
    samples = [int(run.length_s * plan.log.rate_hz) * (rate // plan.log.rate_hz) for run in plan.runs]
    if not plan.cut:
        out = []
        for number, (run, steps) in enumerate(zip(plan.runs, samples, strict=True)):
            time = np.arange(steps) / rate
            stream = plan.stream(f"motion {number}")
            out.append((time, field_motion(stream, run.family, time, plan.machine, plan.style, still)))
        return out
    time = np.arange(sum(samples)) / rate
    stream = plan.stream("motion")
    whole = field_motion(stream, plan.runs[0].family, time, plan.machine, plan.style, still)
    ends = np.cumsum([0, *samples])
    pieces = [slice(first, last) for first, last in pairwise(ends)]
    return [
        (time[own] - time[own][0], Motion(whole.position[own], whole.velocity[own], whole.acceleration[own]))
        for own in pieces
    ]


def _motor_track(plan: FieldPlan, arm: Arm, time: Array, links: Motion) -> Track:
    load = rigid_body_torque(arm, links)
    motors = np.array([links.position, links.velocity, links.acceleration])
    for joint, drive in enumerate(plan.drives):
        if drive.twist > 0 or drive.gap > 0:
            twist = make_interp_spline(time, _twist(drive, load[:, joint]), k=5)
            for order in range(3):
                motors[order, :, joint] += twist(time, order)
    motion = Motion(*motors)
    rotors = np.array(arm.rotor_inertia or np.zeros(len(arm)))
    return Track(time, motion, load + rotors * motion.acceleration)


def _twist(drive: Drive, load: Array) -> Array:
    width = max(CROSSING * float(np.std(load)), 1e-9)
    return np.asarray(drive.twist * load + drive.gap / 2 * np.tanh(load / width))


def _friction(plan: FieldPlan, track: Track) -> Array:
    return np.column_stack([each.torque(track, joint) for joint, each in enumerate(plan.friction)])


def _rest_columns(plan: FieldPlan, number: int, track: Track) -> list[Array]:
    """Kinds of rest of each joint along a run."""
    out = []
    for joint, each in enumerate(plan.rest):
        state = plan.friction[joint].state(track.position[:, joint])
        stream = plan.stream(f"rest {number} {joint}")
        top, half_turn = float(plan.machine.speed[joint]), float(plan.half_turns[joint])
        out.append(each.columns(RestRun(track, joint, state, top, half_turn, stream)))
    return out
