"""Robot files: each kind of mistake is told in one clear line."""

from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refusal

from problem.arm import Arm
from problem.robot_file import load_arm

JOINT = {"name": "joint1", "type": "revolute", "a": 0.1, "d": 0.0, "alpha": 0.0}
LINK = {"mass": 1.0, "first_moment": [0.0, 0.0, 0.0], "inertia": [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]}
ROBOT = {"name": "one", "dh_convention": "standard", "joints": [JOINT]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"joints": [{**JOINT, "position_limits": [2.0, -1.0]}]},
            "position_limits of joint1 should be [lower, upper], so [-1.0, 2.0]",
        ),
        (
            {"joints": [{**JOINT, "velocity_limit": -1.0}]},
            "'joints[0].velocity_limit' in robot.yaml: should be greater than 0, not -1.0",
        ),
        ({"gravity": [0.0, 0.0]}, "'gravity"),
        ({"joints": [{**JOINT, "a": float("nan")}]}, "robot.yaml, line 4: .nan is not a number to work with"),
        ({"joints": [{**JOINT, "a": float("inf")}]}, "'joints[0].a' in robot.yaml: should be a finite number, not inf"),
        ({"joints": [{**JOINT, "a": "long"}]}, "'joints[0].a' in robot.yaml: should be a valid number, not 'long'"),
        (
            {"joints": [{key: value for key, value in JOINT.items() if key != "alpha"}]},
            "missing key 'joints[0].alpha' in robot.yaml",
        ),
        (
            {"joints": [{**JOINT, "alpah": 0.0}]},
            "unknown key 'alpah' in robot.yaml at joints[0]: did you mean 'alpha'?",
        ),
        ({"gravitiy": [0.0, 0.0, 1.0]}, "unknown key 'gravitiy' in robot.yaml: did you mean 'gravity'?"),
        (
            {"joints": [{**JOINT, "type": "ball"}]},
            "'joints[0].type' in robot.yaml: should be 'revolute' or 'prismatic', not 'ball'",
        ),
        ({"joints": []}, "'joints' in robot.yaml"),
        ({"dh_convention": "distal"}, "should be 'standard' or 'modified', not 'distal'"),
        ({"links": [LINK, LINK]}, "links should have 1 entries, one a joint, has 2"),
        ({"links": []}, "links should have 1 entries, one a joint, has 0"),
        ({"links": [{**LINK, "inertia": [1.0, 1.0, 1.0]}]}, "'links[0].inertia"),
        ({"rotor_inertia": [0.1, 0.2]}, "rotor_inertia should have 1 entries, one a joint, has 2"),
        ({"rotor_inertia": [-0.1]}, "'rotor_inertia[0]' in robot.yaml: should be greater than or equal to 0, not -0.1"),
    ],
)
def test_each_mistake_in_a_robot_file_is_told_in_one_line(
    tmp_path: Path, change: dict[str, object], message: str
) -> None:
    path = tmp_path / "robot.yaml"
    path.write_text(yaml.safe_dump({**ROBOT, **change}, sort_keys=False, default_flow_style=None))
    assert message in refusal(load_arm, str(path)).replace(str(path), "robot.yaml")


def test_the_file_without_mistakes_loads(tmp_path: Path) -> None:
    (tmp_path / "robot.yaml").write_text(yaml.safe_dump({**ROBOT, "links": [LINK], "rotor_inertia": [0.1]}))
    arm = load_arm("robot.yaml", beside=tmp_path)
    assert (len(arm), arm.gravity, arm.rotor_inertia) == (1, (0.0, 0.0, -9.81), (0.1,))
    assert arm.joints[0].limits.position == (-np.inf, np.inf)


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("irb12O", "did you mean 'irb120'?"),
        ("robot.json", "neither a .yaml, .urdf or .xml (MJCF) file nor a built-in arm"),
    ],
)
def test_an_unknown_robot_is_told_what_there_is(name: str, told: str) -> None:
    assert told in refusal(load_arm, name)


def test_an_arm_without_links_says_so_when_asked_for_them() -> None:
    with pytest.raises(ValueError, match="the arm 'bare' has no `links`"):
        _ = Arm("bare", load_arm("irb120").joints).parameters


@pytest.mark.parametrize("suffix", [".yaml", ".urdf"])
def test_a_missing_file_is_named(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"none{suffix}"
    assert refusal(load_arm, str(path)) == f"cannot read {path}: No such file or directory"
