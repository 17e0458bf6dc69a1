"""First and second recordings of a case, from the machine to the folder that a diagnosis may see."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.concealed.arms import Machine
from armlab.concealed.case_files import write_case
from armlab.concealed.engine import Track
from armlab.concealed.loop.draw import POOR_LENGTH_S, CaseDraw, effect_with_peak_torque, poor_reference
from armlab.concealed.motions import USED_RANGE
from armlab.concealed.plan import Plan, RunPlan
from armlab.concealed.simulate import (
    FINE_HZ,
    Controller,
    coarse_track,
    draw_controller,
    rigid_torque,
    run_times,
    simulate_runs,
)
from armlab.concealed.sizing import SimulatedCase, SizedEffects, correct_sizes, effect_multiples, resize_effects
from problem.motion import Motion

CELL_SHARE = 0.35  # of the speeds, accelerations and ranges: a narrow cell, alike for all kinds of second motion


@dataclass(frozen=True, eq=False)
class FirstRecording:
    """A case with its first recording."""

    simulated: SimulatedCase
    controller: Controller


def simulate_first_recording(drawn: CaseDraw) -> FirstRecording:
    """Simulates the poor motion with the effect at the size aimed at."""
    plan, time = drawn.plan, run_times(POOR_LENGTH_S, FINE_HZ)
    wanted = [
        _reference_track(plan, time, poor_reference(plan.stream(f"motion {run}"), time, plan.machine))
        for run in range(2)
    ]
    sized = SizedEffects((effect_with_peak_torque(drawn, wanted),), (drawn.target,))
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    for _ in range(3):
        sized = resize_effects(plan, sized, wanted)
    coarse = simulate_runs(plan, sized.hidden, controller, wanted, [coarse_track(track) for track in wanted])
    sized, coarse = correct_sizes(plan, sized, controller, wanted, coarse)
    fine = simulate_runs(plan, sized.hidden, controller, coarse, wanted)
    return FirstRecording(SimulatedCase(plan, sized, fine, effect_multiples(plan, sized.hidden, fine)), controller)


def simulate_second_recording(first: FirstRecording, motion: Array, name: str) -> SimulatedCase:
    """The case with one run more. motion: (samples, 1 + joints), s and rad, from rest to rest."""
    case, length = first.simulated, float(motion[-1, 0])
    time = run_times(length, FINE_HZ)
    path = make_interp_spline(motion[:, 0], motion[:, 1:], k=5)(np.clip(time, 0.0, length))
    wanted = [_reference_track(case.plan, time, np.asarray(path))]
    coarse = simulate_runs(case.plan, case.hidden, first.controller, wanted, [coarse_track(track) for track in wanted])
    fine = simulate_runs(case.plan, case.hidden, first.controller, coarse, wanted)
    plan = replace(case.plan, runs=(*case.plan.runs, RunPlan(name, length - 0.05, "identify")))
    return SimulatedCase(plan, case.sized, (*case.tracks, *fine), case.multiples)


def write_loop_recording(case: SimulatedCase, observations: Path, truth: Path) -> None:
    """Writes the folder, the truth, and the robot with the limits that every second motion has to keep."""
    write_case(case, observations, truth)
    text = yaml.safe_dump(limited_robot_file(case.plan.machine), sort_keys=False, default_flow_style=None, width=110)
    (observations / "limits.yaml").write_text(text, encoding="utf-8")


def limited_robot_file(machine: Machine) -> dict[str, object]:
    """The robot file for a narrow cell: a share of the speeds, accelerations and ranges that the arm is used with."""
    settings = machine.settings()
    low, high = machine.range
    middle, reach = (low + high) / 2, CELL_SHARE * USED_RANGE * np.minimum((high - low) / 2, 2.0)
    for joint, entry in enumerate(settings["joints"]):
        entry["position_limits"] = [float(middle[joint] - reach[joint]), float(middle[joint] + reach[joint])]
        entry["velocity_limit"] = float(CELL_SHARE * machine.speed[joint])
        entry["acceleration_limit"] = float(CELL_SHARE * machine.acceleration[joint])
    return settings


def _reference_track(plan: Plan, time: Array, position: Array) -> Track:
    """A reference as a track of the arm without hidden effects."""
    step = float(time[1] - time[0])
    velocity = np.gradient(position, step, axis=0)
    motion = Motion(position, velocity, np.gradient(velocity, step, axis=0))
    return Track(time, motion, rigid_torque(plan.true_arm, motion))
