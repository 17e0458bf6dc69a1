"""The next experiment for arms that are not three turning joints."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from next_questions import LATE, verdict_file

from armlab.cli.main import main
from problem.robot_file import BUILT_IN_FOLDER

QUICK = ["--evaluations", "60", "--duration", "3", "--harmonics", "4", "--rate", "50"]
BODY = {"mass": 3.0, "first_moment": [0.0, 0.0, 0.3], "inertia": [0.05, 0.05, 0.02, 0.0, 0.0, 0.0]}


def six_joints() -> dict[str, object]:
    """The whole arm with moderate limits."""
    data: dict[str, list[dict[str, object]]] = yaml.safe_load((BUILT_IN_FOLDER / "irb120.yaml").read_text())
    for joint in data["joints"]:
        joint.update({"velocity_limit": 2.0, "acceleration_limit": 10.0})
    return dict(data)


def lift() -> dict[str, object]:
    """A slide upwards with a turning joint on it: m, m/s, N and rad, rad/s, N m."""
    limits = {"velocity_limit": 0.5, "acceleration_limit": 2.0}
    slide = {
        "name": "slide",
        "type": "prismatic",
        "a": 0.0,
        "d": 0.0,
        "alpha": 1.57,
        "position_limits": [0.0, 0.8],
        **limits,
    }
    turn = {"name": "turn", "type": "revolute", "a": 0.3, "d": 0.0, "alpha": 0.0, "position_limits": [-2.0, 2.0]}
    turn |= {"velocity_limit": 2.0, "acceleration_limit": 10.0}
    return {"name": "lift", "dh_convention": "standard", "joints": [slide, turn], "links": [BODY, BODY]}


@pytest.mark.parametrize(("robot", "joints", "size"), [(six_joints(), 6, 0.3), (lift(), 2, 20.0)])
def test_six_joints_and_a_slide_get_a_motion_within_their_limits(
    tmp_path: Path, robot: dict[str, object], joints: int, size: float
) -> None:
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump(robot))
    found = {"effect": "viscous_friction", "joint": 1, "parameters": {"coefficient": size}, "rivals": [LATE]}
    verdict = verdict_file(tmp_path, found, joints=joints)
    command = ["next", str(verdict), "--robot", str(tmp_path / "robot.yaml"), "--out", str(tmp_path / "out"), *QUICK]
    result = CliRunner().invoke(main, command)
    assert result.exit_code == 0, result.output
    card = json.loads((tmp_path / "out/next.json").read_text())
    errors = card["questions"][0]["pairs"][0]["standard_errors"]
    assert errors["designed"] > max(errors["before"], 1.0)
    motion = np.genfromtxt(tmp_path / "out/next.csv", delimiter=",", names=True)
    for number, limit in enumerate(card["limits"], 1):
        assert np.abs(motion[f"qd{number}"]).max() <= limit["velocity"]
        assert motion[f"q{number}"].min() >= limit["position"][0]
        assert motion[f"q{number}"].max() <= limit["position"][1]
