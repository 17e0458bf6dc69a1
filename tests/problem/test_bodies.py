"""Bodies as people write them: points, rods, plates and frames are bodies; what no body is has a nearest one."""

from pathlib import Path

import numpy as np
import pytest
from robot_file_table import FILES

from armlab.identification.structure import Structure
from armlab.recordings.check import check_recording
from armlab.recordings.imports.files import import_files
from problem.bodies import is_body, nearest_body, with_extent
from problem.impossible_bodies import find_impossible_bodies, repaired_text
from problem.pseudo_inertia import (
    are_bodies,
    least_eigenvalues,
    link_from_centre_of_mass,
    pseudo_inertia_of,
    regular_nominal,
)
from problem.robot_file import load_arm

OPTIONS = {"robot": None, "units": ("position=rad", "torque=N.m"), "validate": (), "separator": None, "decimal": None}


def body(*moments: float, mass: float = 1.0) -> np.ndarray:
    return pseudo_inertia_of(link_from_centre_of_mass(mass, np.array([0.1, 0.2, 0.0]), np.diag(moments)))


@pytest.mark.parametrize(
    ("moments", "mass", "right"),
    [
        ((0.0, 0.0, 0.0), 1.0, True),  # a point
        ((0.0, 0.02, 0.02), 1.0, True),  # a rod
        ((0.01, 0.01, 0.02), 1.0, True),  # a plate
        ((0.0, 0.0, 0.0), 0.0, True),  # a frame
        ((0.03, 0.01, 0.01), 1.0, False),  # 0.03 > 0.01 + 0.01
        ((0.01, 0.01, 0.01), -1.0, False),
    ],
)
def test_points_rods_plates_and_frames_are_bodies_and_a_broken_triangle_is_none(
    moments: tuple[float, ...], mass: float, right: bool
) -> None:
    assert is_body(body(*moments, mass=mass)) is right


def test_the_nearest_body_keeps_mass_and_centre_and_lets_one_moment_be_the_sum_of_the_others() -> None:
    nearest = nearest_body(body(0.03, 0.01, 0.01))
    assert is_body(nearest)
    assert nearest[3, 3] == 1.0
    np.testing.assert_array_equal(nearest[3, :3], [0.1, 0.2, 0.0])
    spread = nearest[:3, :3] - np.outer([0.1, 0.2, 0], [0.1, 0.2, 0])
    moments = np.trace(spread) * np.eye(3) - spread
    np.testing.assert_allclose(np.diag(moments), [0.03, 0.015, 0.015])


@pytest.mark.parametrize("name", ["point_masses", "rods_and_plates", "massless_link_between_joints"])
def test_what_simulators_refuse_gets_extent_that_changes_no_torque_that_matters(name: str) -> None:
    parameters = load_arm(str(FILES / f"{name}.urdf")).parameters
    raised = with_extent(parameters)
    assert least_eigenvalues(raised).min() > 0
    np.testing.assert_allclose(raised, parameters, atol=1e-8 * np.abs(parameters).max())


@pytest.mark.parametrize("name", ["point_masses", "rods_and_plates", "massless_link_between_joints"])
def test_a_prior_about_points_rods_and_frames_is_finite(name: str) -> None:
    arm = load_arm(str(FILES / f"{name}.urdf"))
    assert are_bodies(arm.parameters)
    assert np.linalg.eigvalsh(regular_nominal(arm)).min() > 0


def test_base_parameters_alone_are_no_bodies() -> None:
    structure = Structure(load_arm("irb120"))
    assert not are_bodies(structure.full(structure.base.values(structure.arm.parameters)))


def write_log(folder: Path) -> Path:
    time = np.arange(0, 12, 0.02)
    wave = np.column_stack([time, *(np.sin(time + each) for each in range(4))])
    np.savetxt(folder / "log.csv", wave, delimiter=",", header="t,q1,q2,tau1,tau2", comments="")
    return folder / "log.csv"


@pytest.mark.parametrize("repair", [False, True])
def test_an_import_says_what_no_body_is_and_repair_writes_the_nearest(tmp_path: Path, repair: bool) -> None:
    robot = FILES / "inertia_of_no_body.urdf"
    options = {**OPTIONS, "robot": str(robot), "repair": repair, "topic": None}
    imported = import_files([write_log(tmp_path)], tmp_path / "out", options)
    told = [text for text in imported.plan.doubts if "link 'shoulder': no body has its principal moments" in text]
    assert len(told) == 1
    assert ("which is written" if repair else "which --repair writes") in told[0]
    written = load_arm(str(tmp_path / "out" / robot.name))
    assert bool(least_eigenvalues(written.parameters).min() > -1e-9) is repair
    kinds = [finding.kind for _, finding in check_recording(tmp_path / "out").findings]
    assert ("impossible_link" in kinds) is not repair


def test_a_repair_changes_the_inertia_of_the_wrong_link_alone() -> None:
    path = FILES / "inertia_of_no_body.urdf"
    text = path.read_text()
    repaired = repaired_text(text, path)
    changed = [one for one, other in zip(text.splitlines(), repaired.splitlines(), strict=True) if one != other]
    assert [line.count("<inertia ") for line in changed] == [1]
    assert not find_impossible_bodies(repaired, path)


def test_a_robot_yaml_is_repaired_too(tmp_path: Path) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(
        "name: one\ndh_convention: standard\njoints: [{name: j, type: revolute, a: 0.3, d: 0, alpha: 0}]\n"
        "links: [{mass: 1, first_moment: [0, 0, 0], inertia: [0.03, 0.01, 0.01, 0, 0, 0]}]\n"
    )
    assert "link '1'" in find_impossible_bodies(path.read_text(), path)[0].words
    path.write_text(repaired_text(path.read_text(), path))
    assert not find_impossible_bodies(path.read_text(), path)
