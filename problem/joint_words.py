"""Joints and links as people know them: by the name that the robot file gives a joint.

A name that is no more than the joint's number (`joint2`, `joint_2`, `2`) is written `joint 2`. Joints are counted
from 1, and link 2 is what joint 2 moves.
"""

import re
from collections.abc import Sequence

from armlab.common.report.wording import join_words
from problem.arm import Arm


def joint_in_words(arm: Arm, joint: int) -> str:
    """`shoulder_lift`, or `joint 2`, in a sentence."""
    return f"joint {joint}" if _is_bare_number(arm, joint) else arm.joints[joint - 1].name


def joint_at_start(arm: Arm, joint: int) -> str:
    """`shoulder_lift`, or `Joint 2`, at the start of a sentence or a title."""
    return f"Joint {joint}" if _is_bare_number(arm, joint) else arm.joints[joint - 1].name


def joint_in_table(arm: Arm, joint: int) -> str:
    """`2 shoulder_lift`, or `2`: in a column of joints, with the number that equations and files have."""
    return str(joint) if _is_bare_number(arm, joint) else f"{joint}\N{NO-BREAK SPACE}{arm.joints[joint - 1].name}"


def joints_in_words(arm: Arm, joints: Sequence[int]) -> str:
    """`joints 1 and 3`, `shoulder_pan and elbow`, `both joints`, `all 6 joints`."""
    if len(set(joints)) == len(arm) > 1:
        return f"{_every(arm)} joints"
    if len(joints) > 1 and all(_is_bare_number(arm, joint) for joint in joints):
        return f"joints {join_words([str(joint) for joint in joints])}"
    return join_words([joint_in_words(arm, joint) for joint in joints])


def links_in_words(arm: Arm, links: Sequence[int]) -> str:
    """`links 1 and 3`, `the links of shoulder_pan and elbow`, `all 6 links`: the links that these joints move."""
    if len(set(links)) == len(arm) > 1:
        return f"{_every(arm)} links"
    plural = "s" if len(links) > 1 else ""
    if all(_is_bare_number(arm, link) for link in links):
        return f"link{plural} {join_words([str(link) for link in links])}"
    return f"the link{plural} of {join_words([joint_in_words(arm, link) for link in links])}"


def _every(arm: Arm) -> str:
    return "both" if len(arm) == 2 else f"all {len(arm)}"


def _is_bare_number(arm: Arm, joint: int) -> bool:
    found = re.fullmatch(r"(?:joint[ _-]?)?0*([1-9][0-9]*)", arm.joints[joint - 1].name, re.IGNORECASE | re.ASCII)
    return found is not None and int(found[1]) == joint
