"""A robot file that stands in a recording folder is read where its meshes are not at hand."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from armlab.recordings.imports.files import import_files
from problem.robot_file import load_arm

CORNERS = "\n".join(f"v {x} {y} {z}" for x in (0, 1) for y in (0, 0.5) for z in (0, 0.2))
SIDES = ("1 2 4", "1 4 3", "5 7 8", "5 8 6", "1 5 6", "1 6 2", "3 4 8", "3 8 7", "1 3 7", "1 7 5", "2 6 8", "2 8 4")
CUBE = "\n".join([CORNERS, *(f"f {side}" for side in SIDES)])
ARM = """<mujoco><compiler meshdir="../shapes" angle="radian" inertiafromgeom="{option}"/><!-- ours -->
<asset><mesh name="cube" file="cube.obj" scale=".2 .2 .2"/></asset>
<worldbody><body name="a"><joint name="j1" axis="0 1 0" damping=".3"/>{inertial}<geom name="g" type="mesh" mesh="cube"/>
<body name="b" pos=".2 0 0"><joint name="j2" axis="0 0 1"/><geom size=".05" pos=".1 0 0"/></body></body></worldbody>
</mujoco>"""
INERTIAL = '<inertial mass="2" pos=".1 0 0" diaginertia=".01 .02 .02"/>'
OPTIONS = {"units": ("position=rad", "torque=N.m"), "validate": (), "separator": None, "decimal": None, "topic": None}


def write_robot(folder: Path, inertial: str, option: str) -> Path:
    for name in ("robot", "shapes"):
        (folder / name).mkdir()
    (folder / "shapes" / "cube.obj").write_text(CUBE)
    (folder / "robot" / "arm.xml").write_text(ARM.format(inertial=inertial, option=option))
    return folder / "robot" / "arm.xml"


@pytest.mark.parametrize(("inertial", "option"), [(INERTIAL, "auto"), ("", "auto"), (INERTIAL, "true")])
def test_a_copied_recording_folder_opens_elsewhere_with_the_same_bodies(
    tmp_path: Path, inertial: str, option: str
) -> None:
    path = write_robot(tmp_path, inertial, option)
    time = np.arange(0, 12, 0.02)
    wave = np.column_stack([time, *(np.sin(time + each) for each in range(4))])
    np.savetxt(tmp_path / "log.csv", wave, delimiter=",", header="t,q1,q2,tau1,tau2", comments="")
    import_files([tmp_path / "log.csv"], tmp_path / "own", {**OPTIONS, "robot": str(path)})
    expected = load_arm(str(path)).parameters
    shutil.copytree(tmp_path / "own", tmp_path / "elsewhere" / "deeper" / "copied")
    shutil.rmtree(tmp_path / "shapes")
    arm = load_arm(str(tmp_path / "elsewhere" / "deeper" / "copied" / "arm.xml"))
    np.testing.assert_allclose(arm.parameters, expected, atol=1e-9)


def test_a_file_whose_mass_comes_from_a_mesh_that_is_not_at_hand_is_refused_by_the_name_of_the_body(
    tmp_path: Path,
) -> None:
    path = write_robot(tmp_path, "", "auto")
    shutil.rmtree(tmp_path / "shapes")
    assert "body 'a': its mass comes from a mesh, which is not at hand" in refusal(load_arm, str(path))
