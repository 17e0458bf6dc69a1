"""Recordings of a closed loop: drawn with an effect that is easily confused, simulated, and written.

The first recording is poor; a second motion adds one run to it.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yaml
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.case_files import write_case
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.library import LIBRARY
from armlab.proof.blind.formats import Tier
from armlab.proof.blind.motions import USED_RANGE
from armlab.proof.blind.plan import BACKGROUND_EFFECTS, DEVELOPMENT_SEEDS, Plan, RunPlan, draw_plan, random_stream
from armlab.proof.blind.simulate import (
    FINE_HZ,
    Controller,
    coarse_track,
    draw_controller,
    run_times,
    simulate_runs,
    track_reference,
)
from armlab.proof.blind.sizing import SimulatedCase, SizedEffects, correct_sizes, effect_multiples, resize_effects


@dataclass(frozen=True)
class LoopDraws:
    """What the cases of a closed loop are drawn from; chosen on development seeds, so that verdicts are in doubt.

    arm: the only arm. length_s, frequency_hz: of a poor first motion. swing: its amplitude, share of the used range.
    vigour: its speed and acceleration, share of what the arm is used with. realistic_share: share of the draws.
    multiples: detection limits of the hidden effect in the first recording. cell_share: speeds, accelerations and
    ranges of all second motions, share of what the arm is used with.
    """

    arm: str = "irb120-arm"
    length_s: float = 8.0
    frequency_hz: tuple[float, float] = (0.2, 0.45)
    swing: tuple[float, float] = (0.15, 0.4)
    vigour: tuple[float, float] = (0.2, 0.6)
    realistic_share: float = 0.3
    multiples: tuple[float, float] = (1.0, 2.5)
    cell_share: float = 0.35


LOOP = LoopDraws()
POOR_RUNS = (RunPlan("poor", LOOP.length_s, "identify"), RunPlan("poor", LOOP.length_s, "validate"))


def poor_reference(rng: np.random.Generator, time: Array, machine: Machine) -> Array:
    """One sine a joint about a place of its own, nearly at one frequency for all, (steps, joints), rad."""
    low, high = machine.range
    middle, reach = (low + high) / 2, USED_RANGE * np.minimum((high - low) / 2, 2.0)
    pulse = 2 * np.pi * rng.uniform(*LOOP.frequency_hz) * rng.uniform(0.9, 1.1, machine.joints)
    allowed = np.minimum(machine.speed / pulse, machine.acceleration / pulse**2)
    swing = np.minimum(
        rng.uniform(*LOOP.swing, machine.joints) * reach, rng.uniform(*LOOP.vigour, machine.joints) * allowed
    )
    place = middle + rng.uniform(-0.6, 0.6, machine.joints) * (reach - swing)
    return np.asarray(place + swing * np.sin(np.outer(time, pulse) + rng.uniform(0, 2 * np.pi, machine.joints)))


# (hidden, what it is confused with); effects that no motion separates are left out: cables, rotors, loads, gains
CONFUSABLE_PAIRS = (
    ("time_delay", "viscous_friction"),
    ("load_dependent_friction", "coulomb_friction"),
    ("nonlinear_viscous_friction", "viscous_friction"),
    ("gravity_compensator", "cable_stiffness"),
    ("stribeck_friction", "coulomb_friction"),
    ("presliding_hysteresis", "coulomb_friction"),
    ("channel_skew", "time_delay"),
    ("friction_drift", "viscous_friction"),
    ("encoder_offset", "torque_offset"),
    ("coulomb_friction", "load_dependent_friction"),
    ("viscous_friction", "nonlinear_viscous_friction"),
    ("time_delay", "channel_skew"),
    ("torque_offset", "encoder_offset"),
    ("joint_elasticity", "time_delay"),
)


@dataclass(frozen=True, eq=False)
class CaseDraw:
    """One case before it is simulated. pair: names that are easily confused, the hidden one first."""

    plan: Plan
    pair: tuple[str, str]
    effect: HiddenEffect
    target: float


def draw_case(seed: int, case: int, attempt: int) -> CaseDraw:
    """The attempt-th draw of a case: the pairs in turn, with and without usual friction and links that are off."""
    rng = random_stream("loop", seed, case, attempt)
    pair = CONFUSABLE_PAIRS[(case + attempt) % len(CONFUSABLE_PAIRS)]
    realistic = rng.random() < LOOP.realistic_share and pair[0] not in BACKGROUND_EFFECTS  # these are on every joint
    tier: Tier = "realistic" if realistic else "clean"
    plan = _draw_plan(seed, case, attempt, tier)
    kind = next(each for each in LIBRARY if each.effect == pair[0])
    joint = int(rng.choice(list(kind.places(plan.machine))))
    target = float(np.exp(rng.uniform(*np.log(LOOP.multiples))))
    return CaseDraw(plan, pair, kind.draw(rng, plan.machine, joint), target)


def _draw_plan(seed: int, case: int, attempt: int, tier: Tier) -> Plan:
    """A plan for the three-joint arm; other arms are passed over."""
    for number in range(1000):
        index = (100 * case + attempt) * 1000 + number
        plan = draw_plan(seed, index, tier, only_nulls=False, development=seed in DEVELOPMENT_SEEDS)
        if plan.machine.name == LOOP.arm and plan.kind in ("single", "pair", "triple"):
            return replace(plan, kind="single", runs=POOR_RUNS, rate_hz=min(plan.rate_hz, 500))
    raise ValueError(f"no plan of seed {seed} is about {LOOP.arm}")


@dataclass(frozen=True, eq=False)
class FirstRecording:
    """A case with its first recording."""

    simulated: SimulatedCase
    controller: Controller


def simulate_first_recording(drawn: CaseDraw) -> FirstRecording:
    """Simulates the poor motion with the effect at the size aimed at."""
    plan, time = drawn.plan, run_times(LOOP.length_s, FINE_HZ)
    wanted = [
        track_reference(plan, time, poor_reference(plan.stream(f"motion {run}"), time, plan.machine))
        for run in range(2)
    ]
    peak = np.max([np.abs(track.load).max(axis=0) for track in wanted], axis=0)
    sized = SizedEffects((drawn.effect.with_peak_torque(peak),), (drawn.target,))
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
    wanted = [track_reference(case.plan, time, np.asarray(path))]
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
    middle, reach = (low + high) / 2, LOOP.cell_share * USED_RANGE * np.minimum((high - low) / 2, 2.0)
    for joint, entry in enumerate(settings["joints"]):
        entry["position_limits"] = [float(middle[joint] - reach[joint]), float(middle[joint] + reach[joint])]
        entry["velocity_limit"] = float(LOOP.cell_share * machine.speed[joint])
        entry["acceleration_limit"] = float(LOOP.cell_share * machine.acceleration[joint])
    return settings
