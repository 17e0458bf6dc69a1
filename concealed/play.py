"""Plays the runs of a case: reference tracks, and simulations of the arm as it really is."""

from collections.abc import Sequence

import numpy as np

from concealed.effects.hidden import Hidden
from concealed.engine import Parts
from concealed.motions import reference
from concealed.plan import Plan, RunPlan
from concealed.shares import taken
from concealed.simulate import COARSE_HZ, FINE_HZ, Controller, Reference, rigid_torque, run_times, simulate
from concealed.track import Track
from problem.arm import Arm
from problem.motion import Motion


def wanted_track(plan: Plan, number: int, run: RunPlan) -> Track:
    """The reference of a run, as a track of the arm without hidden effects."""
    time = run_times(run.length_s, FINE_HZ)
    position = reference(run.family, plan.stream(f"motion {number}"), time, plan.machine)
    step = float(time[1] - time[0])
    velocity = np.gradient(position, step, axis=0)
    motion = Motion(position, velocity, np.gradient(velocity, step, axis=0))
    return Track(time, motion, rigid_torque(plan.true_arm, motion))


def true_arm(plan: Plan, hidden: Sequence[Hidden]) -> Arm:
    """The arm with links that are off and with the hidden bodies."""
    arm = plan.true_arm
    for effect in hidden:
        arm = effect.arm(arm)
    return arm


def play(
    plan: Plan, hidden: Sequence[Hidden], controller: Controller, before: Sequence[Track], wanted: Sequence[Track]
) -> tuple[Track, ...]:
    """Simulates all runs, at the step of the wanted tracks, with what the effects took on the tracks before."""
    arm, usual = true_arm(plan, hidden), 1 - controller.compensated
    parts = sum((effect.parts() for effect in hidden), Parts())
    out = []
    for run, (goal, track) in enumerate(zip(wanted, before, strict=True)):
        known = track.at(goal.time)
        disturbing = usual * taken(plan.background, known, run) + taken(hidden, known, run)
        out.append(simulate(arm, parts, controller, Reference(goal.time, goal.position), disturbing))
    return tuple(out)


def thinned(track: Track) -> Track:
    """A track at the step of the coarse pass."""
    every = slice(None, None, FINE_HZ // COARSE_HZ)
    motion = Motion(track.position[every], track.velocity[every], track.acceleration[every])
    return Track(track.time[every], motion, track.load[every])
