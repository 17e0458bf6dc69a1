"""Presets: each builds, each mistake in their settings is told in one line, and a round trip changes nothing."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refusals import refusal

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.contract import Problem
from problem.excitation import ExcitationProblem, ShiftedProblem
from problem.functions import FUNCTIONS
from problem.registry import names, parse_problem

BARE_URDF = """<robot name="bare"><link name="a"/><link name="b"/>
<joint name="j1" type="continuous"><parent link="a"/><child link="b"/></joint></robot>"""


def build(preset: str, **settings: Any) -> Problem:
    return parse_problem({"preset": preset, **settings}, "study.yaml").build()


def excitation(preset: str, **settings: Any) -> ExcitationProblem:
    problem = build(preset, **settings)
    assert isinstance(problem, ExcitationProblem)
    return problem


def random_points(problem: Problem, count: int = 5) -> Array:
    return np.random.default_rng(0).uniform(problem.lower, problem.upper, (count, len(problem.lower)))


@pytest.mark.parametrize("preset", names())
def test_every_preset_builds_and_judges_its_own_box(preset: str) -> None:
    problem = build(preset)
    assert np.all(problem.lower < problem.upper)
    result = problem.evaluate(random_points(problem))
    assert [part.shape for part in result] == [(5,)] * 3
    assert np.all(np.isfinite(result.fitness))
    assert np.all(result.violation >= 0)


@pytest.mark.parametrize("preset", ["paper", "joint-fourier"])
def test_a_preset_has_points_within_all_limits(preset: str) -> None:
    problem = excitation(preset)
    middle, half = (problem.lower + problem.upper) / 2, (problem.upper - problem.lower) / 2
    directions = np.random.default_rng(0).uniform(-1, 1, (400, len(middle)))
    if preset == "paper":
        directions[:, :3] = np.abs(directions[:, :3])
    result = problem.evaluate(middle + 0.6 * half * directions * np.linspace(0.05, 1, 400)[:, None])
    assert np.any(result.violation == 0)


def test_paper_has_7_numbers_and_joint_fourier_33() -> None:
    assert (len(build("paper").lower), len(build("joint-fourier").lower)) == (7, 33)
    assert len(build("paper", one_c=False).lower) == 9


def test_joint_fourier_takes_the_middle_of_the_ranges_and_shares_the_speed_among_the_harmonics() -> None:
    problem = excitation("joint-fourier")
    np.testing.assert_allclose(np.rad2deg((problem.lower + problem.upper)[10::11] / 2), [0, 0, -20], atol=1e-9)
    np.testing.assert_allclose(np.rad2deg(problem.upper[:10]), 50.0)


def test_limits_of_the_settings_replace_those_of_the_robot_file() -> None:
    limits = excitation(
        "joint-fourier", limits={"velocity": [1, 2, 3], "position": [[-1, 1], None, [0, 1]]}
    ).constraints.limits
    assert [limit.velocity for limit in limits] == [1, 2, 3]
    assert [limit.position for limit in limits] == [(-1, 1), (-np.inf, np.inf), (0, 1)]


@pytest.mark.parametrize(
    ("preset", "settings", "message"),
    [
        ("paper", {"duraton": 5}, "unknown key 'duraton' in study.yaml: did you mean 'duration'?"),
        ("paper", {"penalty": {"wieght": 5}}, "unknown key 'wieght' in study.yaml at penalty: did you mean 'weight'?"),
        ("paper", {"penalty": {"weight": 0}}, "'penalty.weight' in study.yaml: should be greater than 0, not 0"),
        ("paper", {"duration": -1}, "'duration' in study.yaml: should be greater than 0, not -1"),
        ("paper", {"elbow": "left"}, "'elbow' in study.yaml: should be 'up' or 'down', not 'left'"),
        ("paper", {"arm": "irb12O"}, "unknown robot 'irb12O'"),
        ("paper", {"arm": "irb120"}, "a Cartesian path needs an arm of three revolute joints; 'irb120' is another"),
        ("paper", {"joints": 2}, "a Cartesian path needs an arm of three revolute joints"),
        ("paper", {"joints": 4}, "joints: 4 is more than the 3 of 'irb120-arm'"),
        ("paper", {"columns": ["m9"]}, "columns: no parameter 'm9' in irb120-arm: names are like mcx1"),
        ("paper", {"samples": 4}, "samples: 4 of 3 joints cannot show 15 base parameters; take 5 or more"),
        ("joint-fourier", {"samples": 1}, "'samples' in study.yaml: should be greater than or equal to 2, not 1"),
        (
            "joint-fourier",
            {"arm": "irb120", "samples": 5},
            "samples: 5 of 6 joints cannot show 36 base parameters; take 6 or more",
        ),
        ("joint-fourier", {"rest": True, "harmonics": 1}, "rest: true needs at least two harmonics"),
        (
            "joint-fourier",
            {"limits": {"velocity": [1.0, 2.0]}},
            "limits.velocity should have 3 entries, one a joint of 'irb120-arm', has 2",
        ),
        (
            "joint-fourier",
            {"limits": {"position": [[-1, 1]]}},
            "limits.position should have 3 entries, one a joint of 'irb120-arm', has 1",
        ),
        (
            "joint-fourier",
            {"limits": {"position": [[1, -1], None, None]}},
            "limits.position should be [lower, upper], so [-1.0, 1.0]",
        ),
        (
            "joint-fourier",
            {"coefficient_limit": [1.0]},
            "coefficient_limit should have 3 entries, one a joint of 'irb120-arm', has 1",
        ),
        ("sphere", {"dimensions": 3}, "unknown key 'dimensions' in study.yaml: did you mean 'dimension'?"),
        ("sphere", {"dimension": 0}, "'dimension' in study.yaml: should be greater than or equal to 1, not 0"),
        ("papr", {}, "study.yaml: unknown preset 'papr': did you mean 'paper'?"),
    ],
)
def test_each_mistake_is_told_in_one_line(preset: str, settings: dict[str, Any], message: str) -> None:
    assert message in refusal(build, preset, **settings)


@pytest.mark.parametrize("data", [{}, {"preset": 3}, ["paper"], None])
def test_data_without_a_preset_is_told_what_it_needs(data: Any) -> None:
    with pytest.raises(InputError, match=r"study\.yaml: should hold `preset: NAME`, one of paper, joint-fourier"):
        parse_problem(data, "study.yaml")


def test_a_torque_limit_needs_links(tmp_path: Path) -> None:
    path = tmp_path / "bare.urdf"
    path.write_text(BARE_URDF)
    told = refusal(build, "joint-fourier", arm=str(path), coefficient_limit=1.0, limits={"torque": 5.0})
    assert told == (
        "a torque limit needs the inertial parameters of 'bare', whose file has no `links`; "
        "`limits: {torque: none}` drops it"
    )
    assert build("joint-fourier", arm=str(path), coefficient_limit=1.0)


def test_without_a_speed_limit_a_coefficient_limit_is_asked_for(tmp_path: Path) -> None:
    path = tmp_path / "bare.urdf"
    path.write_text(BARE_URDF)
    assert (
        refusal(build, "joint-fourier", arm=str(path))
        == "'bare' has joints without a speed limit: give `coefficient_limit` in rad/s"
    )


def test_the_same_trajectory_is_worth_the_same_in_a_random_frame() -> None:
    plain, framed = build("joint-fourier"), build("random-frame")
    assert isinstance(framed, ShiftedProblem)
    points = random_points(plain)
    for ours, theirs in zip(plain.evaluate(points), framed.evaluate(points + framed.shift), strict=True):
        np.testing.assert_allclose(theirs, ours, rtol=1e-9)
    np.testing.assert_allclose(framed.upper - framed.lower, plain.upper - plain.lower)


def test_frames_differ_by_seed_and_lie_within_two_widths_of_the_box() -> None:
    frames = [build("random-frame", frame_seed=seed) for seed in range(20)]
    shifts = np.array([frame.shift for frame in frames if isinstance(frame, ShiftedProblem)])
    widths = frames[0].upper - frames[0].lower
    assert len(np.unique(shifts, axis=0)) == 20
    assert np.all(np.abs(shifts) <= 2 * widths)
    assert np.abs(shifts / widths).max() > 1.5
    assert len({frame.name for frame in frames}) == 20


SETTINGS: list[dict[str, Any]] = [
    *({"preset": preset} for preset in names()),
    {"preset": "paper", "columns": ["m2", "Iyy1"], "one_c": False, "criterion": {"kind": "d_optimality"}},
    {"preset": "joint-fourier", "arm": "irb120", "joints": 4, "coefficient_limit": [1, 2, 3, 4], "frame_seed": 3},
    {
        "preset": "joint-fourier",
        "limits": {"position": [None, [-1, 1], None], "torque": 50.0},
        "workspace": {"reach": 0.9, "floor": 0.0, "keep_out": [[1, 1, 1], [2, 2, 2]]},
        "unit_columns": True,
    },
]


@pytest.mark.parametrize("data", SETTINGS, ids=lambda data: "-".join(map(str, data)))
def test_settings_written_out_and_read_again_are_the_same_problem(data: dict[str, Any]) -> None:
    settings = parse_problem(data, "study.yaml")
    again = parse_problem(settings.model_dump(mode="json"), "study.yaml")
    assert again == settings
    one, other = settings.build(), again.build()
    points = random_points(one)
    for ours, theirs in zip(one.evaluate(points), other.evaluate(points), strict=True):
        assert np.array_equal(ours, theirs)


@pytest.mark.parametrize("preset", names())
def test_a_problem_sent_to_another_process_is_the_same_problem(preset: str) -> None:
    problem = build(preset)
    points = random_points(problem)
    for ours, theirs in zip(
        problem.evaluate(points), pickle.loads(pickle.dumps(problem)).evaluate(points), strict=True
    ):
        assert np.array_equal(ours, theirs)


@pytest.mark.parametrize("preset", sorted(FUNCTIONS))
def test_a_test_function_has_its_minimum_zero_at_the_optimum_and_nowhere_else(preset: str) -> None:
    for shift_seed in (None, 4):
        problem = build(preset, dimension=3, shift_seed=shift_seed)
        optimum = problem.optimum
        around = optimum + np.random.default_rng(0).normal(scale=0.3, size=(50, 3))
        assert problem.evaluate(optimum[None]).value == pytest.approx([0.0], abs=1e-12)
        assert np.all(problem.evaluate(around).value > 0)
        assert np.all((problem.lower <= optimum) & (optimum <= problem.upper))


@pytest.mark.parametrize(
    ("preset", "value"),
    [
        ("sphere", 14.0),
        ("ellipsoid", 1 + 4e3 + 9e6),
        ("rosenbrock", 100 * (3 - 4) ** 2 + 1 + 100 * (4 - 9) ** 2 + 4),
        ("rastrigin", 14.0),
    ],
)
def test_a_test_function_at_1_2_3_is_as_its_definition_gives_by_hand(preset: str, value: float) -> None:
    assert build(preset, dimension=3).evaluate(np.array([[1.0, 2.0, 3.0]])).value == pytest.approx([value])


@pytest.mark.parametrize(("limits", "least", "most"), [({}, 0.012, 0.015), ({"position": "robot"}, 0.0015, 0.0025)])
def test_share_of_feasible_points_of_the_paper_is_the_one_that_the_documentation_names(
    limits: dict[str, str], least: float, most: float
) -> None:
    problem = parse_problem({"preset": "paper", "limits": limits}, "test").build()
    points = np.random.default_rng(0).uniform(problem.lower, problem.upper, (50_000, len(problem.lower)))
    assert least < np.mean(problem.evaluate(points).violation == 0) < most
