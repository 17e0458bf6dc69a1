"""Exported trajectories: read back, at rest at both ends, within all limits at the controller's rate."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refusal

from armlab.common.arrays import Array
from bench.studies.best_known.export import export_record
from bench.studies.best_known.records import RECORDS_FILE, Record, write_records
from bench.trajectory_files import TRAJECTORY_FORMATS, SampledTrajectory, sample_trajectory, to_csv, to_rapid, to_ros2
from problem.motion import Motion
from problem.registry import parse_problem
from problem.safe_motion import SafetySettings

ROOT = Path(__file__).parents[2]
REST = {"preset": "joint-fourier", "rest": True, "harmonics": 3, "duration": 4.0}


def write(tmp_path: Path, name: str = "gentle", share: float = 0.3, **settings: object) -> Path:
    """A record of a trajectory that takes a share of its box, and the problem's file."""
    full = parse_problem({**REST, **settings}, "test")
    problem = full.build()
    point = np.random.default_rng(1).uniform(-share, share, len(problem.lower)) * (problem.upper - problem.lower) / 2
    record = Record(
        settings=full.model_dump(mode="json"),
        value=1.0,
        coefficients={str(n): x for n, x in enumerate(point + (problem.lower + problem.upper) / 2)},
        method="",
        seed=0,
        start=0,
        evaluations=0,
        gradients=0,
        versions={},
    )
    write_records(tmp_path / RECORDS_FILE, {name: record})
    path = tmp_path / "problem.yaml"
    path.write_text(yaml.safe_dump({**REST, **settings}))
    return path


def exported(tmp_path: Path, form: str, rate_hz: float = 50.0) -> tuple[SampledTrajectory, str]:
    out = tmp_path / "out"
    trajectory = export_record(write(tmp_path), "gentle", form, out, tmp_path / RECORDS_FILE, rate_hz).trajectory
    return trajectory, out.read_text()


def parts(trajectory: SampledTrajectory) -> list[Array]:
    motion = trajectory.motion
    return [motion.position, motion.velocity, motion.acceleration]


def test_csv_read_back_is_the_trajectory(tmp_path: Path) -> None:
    trajectory, text = exported(tmp_path, "csv")
    header, *rows = csv.reader(text.splitlines())
    assert header == ["t", "q1", "q2", "q3", "qd1", "qd2", "qd3", "qdd1", "qdd2", "qdd3"]
    table = np.array(rows, dtype=float)
    np.testing.assert_allclose(table[:, 0], np.linspace(0, 4, 201), atol=1e-9)
    np.testing.assert_allclose(table[:, 1:], np.hstack(parts(trajectory)), atol=1e-9)


def test_a_trajectory_found_with_friction_columns_serves_a_problem_without_them(tmp_path: Path) -> None:
    path = write(tmp_path, friction_columns=True)
    path.write_text(yaml.safe_dump(REST))
    trajectory = export_record(path, "gentle", "csv", tmp_path / "out", tmp_path / RECORDS_FILE, 50.0).trajectory
    assert trajectory.motion.samples == 201


def test_ros2_read_back_is_the_trajectory_with_every_key_of_the_message(tmp_path: Path) -> None:
    trajectory, text = exported(tmp_path, "ros2")
    message = yaml.safe_load(text)
    assert list(message) == ["header", "joint_names", "points"]
    assert message["header"] == {"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""}
    assert message["joint_names"] == ["joint1", "joint2", "joint3"]
    keys = ("positions", "velocities", "accelerations")
    for key, part in zip(keys, parts(trajectory), strict=True):
        np.testing.assert_allclose([point[key] for point in message["points"]], part, atol=1e-9)
    starts = [point["time_from_start"] for point in message["points"]]
    assert [start["sec"] + start["nanosec"] / 1e9 for start in starts] == pytest.approx(trajectory.times)
    assert all(0 <= start["nanosec"] < 10**9 and set(start) == {"sec", "nanosec"} for start in starts)
    assert all(set(point) == {*keys, "effort", "time_from_start"} for point in message["points"])


NUMBER = r"-?\d+(?:\.\d+)?(?:E\d+)?"
NAME = r"[A-Za-z][A-Za-z0-9_]{0,31}"
TARGET = rf"\[\[{NUMBER}(?:,{NUMBER}){{5}}\],\[9E9(?:,9E9){{5}}\]\]"
MOVE = rf"MoveAbsJ ({NAME})\{{(\w+)\}} \\NoEOffs, v\d+(?: \\T:={NAME})?, (?:fine|z\d+), tool0;"
STATEMENTS = (
    ("module", rf"MODULE ({NAME})"),
    ("number", rf"CONST num ({NAME}) := ({NUMBER});"),
    ("array", rf"CONST jointtarget ({NAME})\{{(\d+)\}} := \[((?:{TARGET},)*{TARGET})\];"),
    ("procedure", r"PROC main\(\)"),
    ("move", MOVE),
    ("loop", r"FOR (\w+) FROM (\d+) TO (\d+) DO"),
    ("end loop", r"ENDFOR"),
    ("end procedure", r"ENDPROC"),
    ("end module", r"ENDMODULE"),
)


def rapid_statements(text: str) -> list[tuple[str, re.Match[str]]]:
    """The statements of a RAPID module in order; everything that is not exactly one of STATEMENTS fails."""
    assert text.isascii()
    code = " ".join(line.strip() for line in text.splitlines() if not line.strip().startswith("!"))
    code = re.sub(r"\s*([\[\],])\s*", lambda found: found[1] + " " * (found[1] == ","), code)
    code = re.sub(r", ?(?=[\[\-\d])", ",", code).replace(":=[", ":= [")
    found = []
    while code:
        matches = [(kind, match) for kind, form in STATEMENTS if (match := re.match(form, code))]
        assert len(matches) == 1, f"no RAPID that is known here: {code[:80]}"
        found += matches
        code = code[matches[0][1].end() :].strip()
    return found


def test_rapid_is_a_module_of_timed_moves_through_all_targets_in_degrees(tmp_path: Path) -> None:
    trajectory, text = exported(tmp_path, "rapid")
    statements = rapid_statements(text)
    assert [kind for kind, _ in statements] == [
        "module",
        "number",
        "array",
        "procedure",
        "move",
        "loop",
        "move",
        "end loop",
        "move",
        "end procedure",
        "end module",
    ]
    of = dict(statements)
    assert float(of["number"][2]) == pytest.approx(0.02)
    degrees = np.array([row.split(",") for row in re.findall(r"\[\[(.*?)\]", of["array"][3])], dtype=float)
    assert int(of["array"][2]) == len(degrees) == 201
    np.testing.assert_allclose(degrees[:, :3], np.rad2deg(trajectory.motion.position), atol=1e-6)
    assert not degrees[:, 3:].any()
    moves = [match for kind, match in statements if kind == "move"]
    assert {move[1] for move in moves} == {of["array"][1]}
    assert [move[2] for move in moves] == ["1", of["loop"][1], "201"]
    assert [of["loop"][2], of["loop"][3]] == ["2", "200"]
    assert [("\\T:=" in move[0], "fine" in move[0]) for move in moves] == [(False, True), (True, False), (True, True)]


def test_joint_names_are_texts_whatever_they_are(tmp_path: Path) -> None:
    trajectory, _ = exported(tmp_path, "ros2")
    message = yaml.safe_load(to_ros2(replace(trajectory, joint_names=("1", "on", "a,b"))))
    assert message["joint_names"] == ["1", "on", "a,b"]


@pytest.mark.parametrize("form", TRAJECTORY_FORMATS)
def test_the_best_known_trajectory_from_rest_to_rest_is_exported_at_250_hz(tmp_path: Path, form: str) -> None:
    out = tmp_path / f"best.{form}"
    problem, records = ROOT / "configs" / "export.yaml", ROOT / "results" / RECORDS_FILE
    trajectory = export_record(problem, "joint-fourier-rest-250hz", form, out, records).trajectory
    motion = trajectory.motion
    assert trajectory.rate_hz == 250.0
    assert out.exists()
    for part in (motion.velocity, motion.acceleration):
        assert np.abs(part[[0, -1]]).max() < 1e-9
    arm = parse_problem(yaml.safe_load(problem.read_text()), "export").build().arm
    for joint, position, velocity in zip(arm.joints, motion.position.T, motion.velocity.T, strict=True):
        low, high = joint.limits.position
        assert low <= position.min() <= position.max() <= high
        assert np.abs(velocity).max() <= joint.limits.velocity
    assert np.abs(motion.acceleration).max() <= 40.0


@pytest.mark.parametrize("name", ["problem", "records"])
def test_an_export_never_replaces_what_it_is_made_from(tmp_path: Path, name: str) -> None:
    path, records = write(tmp_path), tmp_path / RECORDS_FILE
    out = {"problem": path, "records": records}[name]
    before = out.read_bytes()
    told = refusal(export_record, path, "gentle", "csv", out, records, 50.0)
    assert "is a file that the trajectory is made from" in told
    assert out.read_bytes() == before


def test_an_export_says_what_was_checked_and_refuses_what_leaves_its_room(tmp_path: Path) -> None:
    path, records, out = write(tmp_path), tmp_path / RECORDS_FILE, tmp_path / "out"
    report = export_record(path, "gentle", "csv", out, records, safety=SafetySettings(floor=0.0)).safety
    assert report.least["the floor"] >= 0.02
    out.unlink()
    box = ((-0.2, -0.2, 0.6), (0.5, 0.2, 2.0))
    for settings, told in (
        (SafetySettings(floor=report.least["the floor"] - 0.01), "the floor"),
        (SafetySettings(keep_out=(box,)), "box 1; 0.02 m are to be kept"),
        (SafetySettings(near=(1.0, 0.0, 0.0)), "joint1 starts or ends at"),
        (SafetySettings(range=((-0.01, 0.01), (-1.0, 1.0), (-1.0, 1.0))), "outside the given range"),
    ):
        assert told in refusal(export_record, path, "gentle", "csv", out, records, safety=settings)
    assert not out.exists()


def test_derivatives_fit_the_positions(tmp_path: Path) -> None:
    trajectory, _ = exported(tmp_path, "csv", 500.0)
    position, velocity, acceleration = parts(trajectory)
    np.testing.assert_allclose(np.gradient(position, 1 / 500, axis=0)[1:-1], velocity[1:-1], atol=1e-3)
    np.testing.assert_allclose(np.gradient(velocity, 1 / 500, axis=0)[1:-1], acceleration[1:-1], atol=1e-2)


def test_a_limit_that_is_kept_at_the_samples_but_broken_at_the_rate_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, share=0.6, samples=13)
    problem = parse_problem(yaml.safe_load(path.read_text()), "test").build()
    point = np.array(
        list(yaml.safe_load((tmp_path / RECORDS_FILE).read_text())["problems"]["gentle"]["coefficients"].values())
    )
    motion = problem.trajectory.motions(point[None], np.linspace(0, 4, 13)).motion
    seen = float(np.abs(motion.velocity[..., 1]).max())
    path.write_text(yaml.safe_dump({**REST, "limits": {"velocity": [99.0, seen * (1 + 1e-9), 99.0]}}))
    told = refusal(export_record, path, "gentle", "csv", tmp_path / "out", tmp_path / RECORDS_FILE)
    assert re.fullmatch(
        r"gentle breaks a limit at 250 Hz: speed of joint2 reaches [\d.]+, limit [\d.]+ \(SI\); "
        r"take a record with more samples",
        told,
    )
    assert not (tmp_path / "out").exists()
    assert export_record(path, "gentle", "csv", tmp_path / "out", tmp_path / RECORDS_FILE, 3.0)


@pytest.mark.parametrize(
    ("record", "rate_hz", "other", "message"),
    [
        ("gentl", 250.0, {}, "no record 'gentl' in {file}: did you mean 'gentle'?"),
        ("gentle", 7.1, {}, "gentle: 4 s is not a whole number of periods of 7.1 Hz"),
        (
            "gentle",
            50.0,
            {"duration": 5.0},
            "{path}: 'duration' is 5.0, the record 'gentle' has 4.0: it is of another trajectory",
        ),
    ],
)
def test_each_mistake_is_told_in_one_line(
    tmp_path: Path, record: str, rate_hz: float, other: dict[str, object], message: str
) -> None:
    path = write(tmp_path)
    path.write_text(yaml.safe_dump({**REST, **other}))
    told = refusal(export_record, path, record, "csv", tmp_path / "out", tmp_path / RECORDS_FILE, rate_hz)
    assert told == message.format(file=tmp_path / RECORDS_FILE, path=path)


def test_a_trajectory_that_starts_in_motion_is_refused(tmp_path: Path) -> None:
    path = write(tmp_path, rest=False)
    told = refusal(export_record, path, "gentle", "csv", tmp_path / "out", tmp_path / RECORDS_FILE)
    assert told == "gentle is not at rest at both ends: take a record of a problem with `rest: true`"


def test_a_seventh_axis_is_nothing_that_rapid_can_take() -> None:
    still = Motion(*(np.zeros((2, 7)) for _ in range(3)))
    trajectory = SampledTrajectory("seven", tuple("abcdefg"), ("revolute",) * 7, 10.0, still)
    assert "at most 6 axes, all of them revolute: seven has 7 joints, 0 of them" in refusal(to_rapid, trajectory)
    assert to_csv(trajectory).count("\n") == 3
    assert len(yaml.safe_load(to_ros2(trajectory))["points"]) == 2


def test_sampling_includes_both_ends(tmp_path: Path) -> None:
    problem = parse_problem(REST, "test").build()
    middle = (problem.lower + problem.upper) / 2
    trajectory = sample_trajectory(problem, middle, 10.0, "still")
    assert trajectory.times[[0, -1]].tolist() == [0.0, 4.0]
