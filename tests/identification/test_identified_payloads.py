"""Loads and torque gains from recordings with and without a load."""

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from refusals import refusal
from simulated_arm import RATE_HZ, arm, motion

from armlab.cli.identification import gains, payload
from armlab.common.arrays import Array
from armlab.identification.payload import PayloadSetting, Place, gains_lines, identify_payload, payload_lines
from armlab.identification.priors import point_mass
from armlab.identification.regression import signals_of
from armlab.identification.structure import Structure
from armlab.recordings.recording import Run
from armlab.recordings.recording_file import Draft, DraftRun, write_recording
from problem.arm import Arm
from problem.motion import Motion
from problem.pseudo_inertia import least_eigenvalues
from problem.regressor import observation_matrix
from problem.robot_file import load_arm

CENTRE = (0.05, -0.02, 0.1)
MASS = 3.0
ON_LINK_2 = Place(2, CENTRE)


def torque_of(robot: Arm, moved: Motion, load: Array, link: int, noise: float, seed: int) -> Array:
    """Rigid torque with a load (10,) on a link, viscous friction, white noise."""
    phi = robot.parameters.copy()
    phi[10 * link - 10 : 10 * link] += load
    torque = (observation_matrix(robot, moved) @ phi).reshape(moved.samples, -1) + 0.5 * moved.velocity
    return torque + noise * np.random.default_rng(seed).standard_normal(torque.shape)


def recording(folder: Path, load: Array, link: int, seed: int, factors: tuple[float, ...] = (1.0, 1.0, 1.0)) -> Path:
    """A recording of the three-joint arm that carries a load (10,) on a link."""
    time, moved = motion(seed)
    torque = torque_of(arm(), moved, load, link, 0.05, seed) * factors
    names = ("t", "q1", "q2", "q3", "tau1", "tau2", "tau3")
    runs = (DraftRun("run.csv", "identify", names, np.column_stack([time, moved.position, torque])),)
    columns = {"time": "t", "position": names[1:4], "torque": names[4:]}
    units = {"time": "s", "position": "rad", "torque": "N.m"}
    return write_recording(Draft("irb120-arm", columns, units, runs), folder)


@pytest.fixture
def pair(tmp_path: Path) -> tuple[Path, Path]:
    """Recordings with and without 3 kg on link 2."""
    load = MASS * point_mass(1, CENTRE)
    return recording(tmp_path / "with", load, 2, 1), recording(tmp_path / "without", np.zeros(10), 2, 2)


def invoke(command: object, *arguments: object) -> str:
    result = CliRunner().invoke(command, [str(each) for each in arguments], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def interval(line: str) -> tuple[float, float]:
    low, high = line.split("[")[1].split("]")[0].split(",")
    return float(low), float(high)


def test_the_mass_of_a_load_is_found_with_an_interval_that_holds_it(pair: tuple[Path, Path]) -> None:
    text = invoke(payload, pair[0], "--without", pair[1], "--link", 2, "--centre", *CENTRE)
    low, high = interval(text)
    assert low < MASS < high
    assert high - low < 0.1


def test_a_known_load_shows_the_gain_of_the_joints_that_it_loads(tmp_path: Path) -> None:
    factors = (1.0, 1.09, 0.95)
    load = 5 * point_mass(1, CENTRE)
    loaded = recording(tmp_path / "with", load, 2, 1, factors)
    without = recording(tmp_path / "without", np.zeros(10), 2, 2, factors)
    text = invoke(gains, loaded, "--without", without, "--mass", 5, "--link", 2, "--centre", *CENTRE)
    rows = text.splitlines()
    assert rows[2] == "joint 3: the load does not load it enough"
    low, high = interval(rows[1])
    assert low < 1.09 < high
    assert high - low < 0.05


def six_joint_run(load: Array, seed: int, noise: float) -> Run:
    robot = load_arm("irb120")
    halves = [motion(seed + part)[1] for part in (0, 100)]
    moved = Motion(*(np.hstack([getattr(half, name) for half in halves]) for name in vars(halves[0])))
    time = np.arange(moved.samples) / RATE_HZ
    return Run(f"{seed}.csv", "identify", time, moved.position, torque_of(robot, moved, load, 6, noise, seed))


def test_a_load_is_a_body_that_can_exist_even_where_noise_says_otherwise() -> None:
    pytest.importorskip("clarabel")
    structure = Structure(load_arm("irb120"), ())
    without = [signals_of(six_joint_run(np.zeros(10), 1, 1.0), 10.0)]
    loaded = [signals_of(six_joint_run(0.5 * point_mass(1, (0.0, 0.0, 0.05)), 2, 1.0), 10.0)]
    found = identify_payload(structure, without, loaded)
    free = 2 * found.half_widths  # what the noise does to a free fit
    assert least_eigenvalues(found.parameters)[0] > -1e-6
    assert found.parameters[0] > 0
    assert np.all(np.abs(found.parameters - 0.5 * point_mass(1, (0.0, 0.0, 0.05))) < free)


def test_a_load_that_is_not_there_has_no_centre(tmp_path: Path) -> None:
    pytest.importorskip("clarabel")
    folders = [six_joint_recording(tmp_path / str(seed), six_joint_run(np.zeros(10), seed, 1.0)) for seed in (1, 2)]
    text = invoke(payload, folders[0], "--without", folders[1])
    assert "its centre is not determined: the interval of its mass reaches zero" in text
    assert "centre x" not in text


def six_joint_recording(folder: Path, run: Run) -> Path:
    names = ("t", *(f"{name}{joint}" for name in ("q", "tau") for joint in range(1, 7)))
    table = np.column_stack([run.time, run.position, run.torque])
    columns = {"time": "t", "position": names[1:7], "torque": names[7:]}
    units = {"time": "s", "position": "rad", "torque": "N.m"}
    return write_recording(Draft("irb120", columns, units, (DraftRun("run.csv", "identify", names, table),)), folder)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        (PayloadSetting(Place(4, CENTRE)), "--link 4 should be one from 1 to 3"),
        (PayloadSetting(ON_LINK_2, counterbalanced=5), "--counterbalance 5 should be one from 1 to 3"),
        (PayloadSetting(Place(1)), "do not determine the parameters of the load"),
    ],
)
def test_what_cannot_be_told_is_refused_in_one_line(
    pair: tuple[Path, Path], setting: PayloadSetting, message: str
) -> None:
    assert message in refusal(lambda: list(payload_lines(*pair, setting)))


def test_a_recording_without_the_load_that_has_nothing_to_identify_from_is_refused(pair: tuple[Path, Path]) -> None:
    settings = pair[1] / "recording.yaml"
    settings.write_text(settings.read_text().replace("role: identify", "role: validate"))
    assert "no run to identify from" in refusal(lambda: list(payload_lines(*pair, PayloadSetting(ON_LINK_2))))


def test_recordings_of_different_arms_are_refused(pair: tuple[Path, Path], tmp_path: Path) -> None:
    other = tmp_path / "other"
    run = six_joint_run(np.zeros(10), 1, 0.0)
    names = ("t", *(f"q{n}" for n in range(6)), *(f"tau{n}" for n in range(6)))
    columns = {"time": "t", "position": names[1:7], "torque": names[7:]}
    table = np.column_stack([run.time, run.position, run.torque])
    units = {"time": "s", "position": "rad", "torque": "N.m"}
    write_recording(Draft("irb120", columns, units, (DraftRun("run.csv", "identify", names, table),)), other)
    assert "has 6 joints" in refusal(lambda: list(gains_lines(pair[0], other, 1.0, PayloadSetting(ON_LINK_2))))
