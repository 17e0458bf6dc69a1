"""First and second recordings of a case, from the machine to the folder that a diagnosis may see."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.interpolate import make_interp_spline

from concealed.arms import Machine
from concealed.folder import write_case
from concealed.loop.draw import Draw, informed
from concealed.loop.poor import LENGTH_S, poor_reference
from concealed.motions import USED_RANGE
from concealed.passes import Simulated, corrected
from concealed.plan import Plan, RunPlan
from concealed.play import play, thinned
from concealed.simulate import FINE_HZ, Controller, draw_controller, rigid_torque, run_times
from concealed.sizing import Sized, multiples, resized
from concealed.track import Track
from problem.motion import Motion
from recordings.run import Array

CELL = 0.35  # of the speeds, accelerations and ranges: a narrow cell, alike for all kinds of second motion


@dataclass(frozen=True, eq=False)
class Recorded:
    """A case with its first recording."""

    simulated: Simulated
    controller: Controller


def first_recording(drawn: Draw) -> Recorded:
    """Simulates the poor motion with the effect at the size aimed at."""
    plan, time = drawn.plan, run_times(LENGTH_S, FINE_HZ)
    wanted = [_track(plan, time, poor_reference(plan.stream(f"motion {run}"), time, plan.machine)) for run in range(2)]
    sized = Sized((informed(drawn, wanted),), (drawn.target,))
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    for _ in range(3):
        sized = resized(plan, sized, wanted)
    coarse = play(plan, sized.hidden, controller, wanted, [thinned(track) for track in wanted])
    sized, coarse = corrected(plan, sized, controller, wanted, coarse)
    fine = play(plan, sized.hidden, controller, coarse, wanted)
    return Recorded(Simulated(plan, sized, fine, multiples(plan, sized.hidden, fine)), controller)


def second_recording(first: Recorded, motion: Array, name: str) -> Simulated:
    """The case with one run more. motion: (samples, 1 + joints), s and rad, from rest to rest."""
    case, length = first.simulated, float(motion[-1, 0])
    time = run_times(length, FINE_HZ)
    path = make_interp_spline(motion[:, 0], motion[:, 1:], k=5)(np.clip(time, 0.0, length))
    wanted = [_track(case.plan, time, np.asarray(path))]
    coarse = play(case.plan, case.hidden, first.controller, wanted, [thinned(track) for track in wanted])
    fine = play(case.plan, case.hidden, first.controller, coarse, wanted)
    plan = replace(case.plan, runs=(*case.plan.runs, RunPlan(name, length - 0.05, "identify")))
    return Simulated(plan, case.sized, (*case.tracks, *fine), case.multiples)


def write_recording(case: Simulated, observations: Path, truth: Path) -> None:
    """Writes the folder, the truth, and the robot with the limits that every second motion has to keep."""
    write_case(case, observations, truth)
    text = yaml.safe_dump(limited(case.plan.machine), sort_keys=False, default_flow_style=None, width=110)
    (observations / "limits.yaml").write_text(text, encoding="utf-8")


def limited(machine: Machine) -> dict[str, object]:
    """The robot file for a narrow cell: a share of the speeds, accelerations and ranges that the arm is used with."""
    settings = machine.settings()
    low, high = machine.range
    middle, reach = (low + high) / 2, CELL * USED_RANGE * np.minimum((high - low) / 2, 2.0)
    for joint, entry in enumerate(settings["joints"]):
        entry["position_limits"] = [float(middle[joint] - reach[joint]), float(middle[joint] + reach[joint])]
        entry["velocity_limit"] = float(CELL * machine.speed[joint])
        entry["acceleration_limit"] = float(CELL * machine.acceleration[joint])
    return settings


def _track(plan: Plan, time: Array, position: Array) -> Track:
    """A reference as a track of the arm without hidden effects."""
    step = float(time[1] - time[0])
    velocity = np.gradient(position, step, axis=0)
    motion = Motion(position, velocity, np.gradient(velocity, step, axis=0))
    return Track(time, motion, rigid_torque(plan.true_arm, motion))
