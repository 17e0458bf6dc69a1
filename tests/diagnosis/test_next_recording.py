"""What a first recording adds to a design: its noise, its information, sizes, limits, and names that come near."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from engine_cases import NOISE, of_runs, recording, run
from next_questions import verdict_file
from refusals import refusal

from armlab.common.arrays import Array
from armlab.diagnosis.next.experiment import choose_rival_groups, prepare_experiment
from armlab.diagnosis.next.motion import (
    Budget,
    build_excitation_problem,
    limits_in_force,
    random_point,
    recorded_place,
)
from armlab.diagnosis.next.prepare import PreparedQuestions
from armlab.diagnosis.next.problem import tell_apart_problem
from armlab.diagnosis.next.question import Name
from armlab.diagnosis.next.sampling import noise_levels
from armlab.diagnosis.next.verdict_file import read_verdict
from armlab.recordings.recording import Recording
from problem.arm import Arm, Limits
from problem.motion import Motion
from problem.robot_file import load_arm
from problem.safe_motion import SafetySettings, safety_rules

BUDGET = Budget(4.0, 4, evaluations=100)
LOAD = {"effect": "load_dependent_friction", "joint": 2}
LEVEL = {"effect": "coulomb_friction", "joint": 2, "parameters": {"level": 0.4}, "rivals": [LOAD]}


def level(motion: Motion, time: Array) -> Array:
    """Coulomb friction of 0.4 N m at joint 2."""
    torque = np.zeros(motion.position.shape)
    torque[:, 1] = 0.4 * np.sign(motion.velocity[:, 1])
    return torque


def limited() -> Arm:
    """The arm with all limits that a design needs."""
    arm = load_arm("irb120-arm")
    joints = (replace(each, limits=Limits(each.limits.position, 2.0, 10.0)) for each in arm.joints)
    return replace(arm, joints=tuple(joints))


def prepared(folder: Path, first: Recording | None) -> PreparedQuestions:
    return prepare_experiment(verdict_file(folder, LEVEL), limited(), first, None, BUDGET, "exact")[0]


def test_the_noise_is_that_of_the_recording(tmp_path: Path) -> None:
    found = prepared(tmp_path, recording(level))
    share = np.sqrt(found.sampling.cutoff_hz / 100)  # of white noise at 200 Hz that passes the low-pass
    assert noise_levels(found.sampling.noise) == pytest.approx(np.full(3, NOISE * share), rel=0.15)


def test_a_rival_has_the_size_that_fits_the_recording(tmp_path: Path) -> None:
    found = prepared(tmp_path, recording(level))
    rival = found.questions[0].rivals[1]
    chosen = np.append(found.questions[0].found, rival.laws[0].columns)
    gram = found.seen.gram[np.ix_(chosen, chosen)]
    wanted = np.linalg.lstsq(gram, found.seen.vector[chosen])[0][-1]
    assert rival.values[0] == pytest.approx(wanted, rel=0.05)


def test_what_is_known_already_adds_to_what_a_motion_shows(tmp_path: Path) -> None:
    first, arm = recording(level), limited()
    path = verdict_file(tmp_path, LEVEL)
    known, plain = prepare_experiment(path, arm, first, None, BUDGET, "exact")
    question, problem = known.questions[0], tell_apart_problem(known, plain)
    point = random_point(plain, BUDGET)
    before = question.separation(known.before.gram, 0, 1)
    new = problem.moments(point).gram
    alone, both = question.separation(new, 0, 1), question.separation(known.total_gram(new), 0, 1)
    assert before > 1
    assert both**2 >= 0.999 * (before**2 + alone**2)  # common parameters can only help


def test_twice_the_recording_holds_twice_the_information(tmp_path: Path) -> None:
    runs = [run(level, seed, "identify", 10.0) for seed in range(2)]
    arm = load_arm("irb120-arm")
    once = prepared(tmp_path, of_runs(arm, tuple(runs)))
    twice = prepared(tmp_path, of_runs(arm, (*runs, *(replace(each, file=f"again-{each.file}") for each in runs))))
    ratio = np.trace(twice.before.gram) / np.trace(once.before.gram)
    assert ratio == pytest.approx(2.0, rel=0.1)


def test_only_rows_from_which_a_diagnosis_learns_count_for_its_score(tmp_path: Path) -> None:
    found = prepared(tmp_path, recording(level))
    assert {each.role for each in recording(level).runs} == {"identify", "validate"}
    assert np.trace(found.before.gram) < 0.9 * np.trace(found.seen.gram)
    assert found.learned_share == 1.0


def test_rivals_count_by_how_well_they_fit_the_recording(tmp_path: Path) -> None:
    finding, load = (rival.weight for rival in prepared(tmp_path, recording(level)).questions[0].rivals)
    assert finding > 0.9
    assert load >= 0.05 - 1e-9


def test_sizes_are_drawn_about_the_fit_and_keep_the_laws_of_physics(tmp_path: Path) -> None:
    rival = prepared(tmp_path, recording(level)).questions[0].rivals[0]
    (law, sizes), *_ = rival.possible_sizes
    assert len(sizes) == 12
    assert law.candidate.effect == "coulomb_friction"
    assert sizes.mean() == pytest.approx(0.4, rel=0.1)
    assert (sizes > 0).all()


def test_limits_that_the_robot_does_not_give_are_what_the_recording_shows() -> None:
    first = recording()
    limits = limits_in_force(load_arm("irb120-arm"), first)
    velocity = np.abs(np.concatenate([np.gradient(each.position, each.time, axis=0) for each in first.runs])).max(
        axis=0
    )
    file = load_arm("irb120-arm").joints
    assert [each.position for each in limits] == [joint.limits.position for joint in file]
    assert [each.velocity for each in limits] == [joint.limits.velocity for joint in file]
    assert all(np.isfinite(each.acceleration) for each in limits)
    assert all(each.velocity > seen for each, seen in zip(limits, velocity, strict=True))


@pytest.mark.parametrize("seed", range(3))
def test_every_motion_starts_near_the_first_pose_of_the_recording_and_stays_near_its_range(seed: int) -> None:
    first, arm = recording(), limited()
    place = recorded_place(first)
    rules = safety_rules(arm, "irb120-arm", limits_in_force(arm, first), SafetySettings(), place)
    problem = build_excitation_problem(arm, limits_in_force(arm, first), BUDGET, rules)
    points = np.random.default_rng(seed).uniform(problem.lower, problem.upper, (20, len(problem.lower)))
    motion = problem.trajectory.motions(points, np.linspace(0, 4, 997)).motion
    ends = motion.position[:, [0, -1]]
    assert np.abs(ends - first.runs[0].position[0]).max() <= 0.1 + 1e-9
    assert np.abs(motion.velocity[:, [0, -1]]).max() < 1e-9
    width = place.highest - place.lowest
    assert np.all(motion.position >= place.lowest - 0.1 * width - 1e-9)
    assert np.all(motion.position <= place.highest + 0.1 * width + 1e-9)
    assert np.abs(motion.velocity).max() <= 2.0
    assert np.abs(motion.acceleration).max() <= 10.0


def near(folder: Path, size: float) -> set[Name]:
    """Names that come near a Coulomb friction of a size, N m."""

    def hidden(motion: Motion, time: Array) -> Array:
        return size * level(motion, time) / 0.4

    found = {"effect": "coulomb_friction", "joint": 2, "parameters": {"level": size}}
    verdict, arm, first = read_verdict(verdict_file(folder, found)), limited(), recording(hidden, seconds=4.0)
    plain = build_excitation_problem(arm, limits_in_force(arm, first), BUDGET)
    return set(choose_rival_groups(verdict, arm, plain, first, "library", "exact", BUDGET)[0])


def test_hysteresis_that_turns_over_at_once_comes_near_any_coulomb_friction(tmp_path: Path) -> None:
    assert Name("presliding_hysteresis", 2) in near(tmp_path, 0.05)


def test_names_that_fit_far_worse_do_not_come_near(tmp_path: Path) -> None:
    far = {Name("viscous_friction", 2), Name("load_dependent_friction", 2), Name("time_delay", None)}
    assert not far & near(tmp_path, 4.0)


def test_a_recording_that_no_diagnosis_could_use_is_refused_in_one_line(tmp_path: Path) -> None:
    whole = recording(level)
    short = replace(whole, runs=tuple(run.rows(slice(200)) for run in whole.runs))
    refused = refusal(prepared, tmp_path, short)
    assert refused.startswith(f"--recording {whole.name}: ")
    assert len(refused.splitlines()) == 1
