"""The line drawing of the arm in the page of a diagnosis."""

import re
from dataclasses import replace

import numpy as np

from armlab.diagnosis.report.arm_picture import JointMark, draw_arm
from problem.robot_file import load_arm


def test_a_guilty_joint_stands_with_its_whole_name_and_all_that_is_said_of_it() -> None:
    arm = load_arm("irb120-arm")
    names = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint")
    named = replace(arm, joints=tuple(replace(one, name=name) for one, name in zip(arm.joints, names, strict=True)))
    marks = {number: JointMark("Coulomb friction, 2 more") for number in (1, 2, 3)}
    texts = re.findall(r"<text[^>]*>([^<]*)</text>", str(draw_arm(named, np.zeros(3), marks)))
    assert sorted(texts) == sorted([*names, *["Coulomb friction, 2 more"] * 3])
