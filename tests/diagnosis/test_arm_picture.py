"""The line drawing of the arm in the page of a diagnosis."""

import re
from dataclasses import replace

import numpy as np

from armlab.report.torque.arm_picture import JointMark, draw_arm
from problem.robot_file import load_arm


def test_a_guilty_joint_stands_with_its_whole_name_and_all_its_causes_in_their_order() -> None:
    arm = load_arm("irb120-arm")
    names = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint")
    named = replace(arm, joints=tuple(replace(one, name=name) for one, name in zip(arm.joints, names, strict=True)))
    causes = ("Coulomb friction", "torque offset", "presliding hysteresis", "load-dependent friction")
    marks = {number: JointMark(causes) for number in (1, 2, 3)}
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", str(draw_arm(named, np.zeros(3), marks)))
    said = " ".join(text for text in texts if text not in names)
    assert said == " ".join([", ".join(causes)] * 3)
    assert sorted(text for text in texts if text in names) == sorted(names)


def test_what_concerns_the_whole_robot_stands_below_the_names_of_its_joints() -> None:
    arm = load_arm("irb120-arm")
    picture = str(draw_arm(arm, np.zeros(3), {2: JointMark(("torque offset",))}, ("base tilt", "clock error")))
    rows = {text: float(y) for y, text in re.findall(r'<text x="[^"]*" y="([^"]*)"[^>]*>([^<]*)</text>', picture)}
    names = [rows[name] for name in ("joint 1", "joint 2", "joint 3", "torque offset")]
    assert max(names) < rows["whole robot: base tilt"] < rows["whole robot: clock error"]
