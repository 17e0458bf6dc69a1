"""A line drawing of the arm from its kinematics, in a recorded posture, with the affected joints marked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.common.report.charts import (
    shorten_text,
    svg_element,
    svg_picture,
    svg_text,
)
from problem.arm import Arm
from problem.joint_words import joint_in_words

PICTURE_WIDTH, ROW_HEIGHT = 412.0, 17.0
MARK_HEIGHT = 13.0  # px: of the line under a joint's name that says what was found there
ARM_WIDTH = 168.0  # px: width of the arm itself; the names stand beside it
BOLD = 1.1  # width of bold letters over that of others, about
ELEVATION = np.deg2rad(18)
AXLE_SHARE = 0.045  # of the arm's size: half the length of a joint's axle
MIN_LENGTH = 1e-9


@dataclass(frozen=True)
class JointMark:
    """What is said of a joint. unknown: no effect of the library explains all of it."""

    text: str
    unknown: bool = False

    @property
    def color(self) -> str:
        """Of the joint and its name."""
        return palette.PURPLE if self.unknown else palette.DARK_VERMILION


@dataclass(frozen=True, eq=False)
class Skeleton:
    """path: corners of the links (points, 3); centres, axes: (joints, 3) of the joints; m, in the base frame."""

    path: Array
    centres: Array
    axes: Array


def arm_skeleton(arm: Arm, position: Array) -> Skeleton:
    """Corners and joints of the arm at joint positions (joints,), rad or m."""
    pose, path = np.eye(4), [np.zeros(3)]
    centres, axes = [], []
    for joint, value in zip(arm.joints, position, strict=True):
        own = pose @ joint.before
        moved = pose @ joint.pose(float(value))
        turned = moved @ np.linalg.inv(joint.after)
        centres.append(own[:3, 3])
        axes.append(own[:3, 2])
        path += [own[:3, 3], turned[:3, 3], moved[:3, 3]]
        pose = moved
    return Skeleton(np.array(path), np.array(centres), np.array(axes))


def clearest_posture(arm: Arm, positions: Array) -> Array:
    """The posture (joints,) among some (rows, joints) in which the arm hides least of itself."""
    return np.asarray(max(positions, key=lambda position: visible_extent(arm_skeleton(arm, position).path)))


def draw_arm(arm: Arm, position: Array, marks: Mapping[int, JointMark], whole: Sequence[str] = ()) -> Markup:
    """The arm as SVG. marks: by joint, from 1. whole: what concerns the robot as a whole."""
    bones = arm_skeleton(arm, position)
    rows = ROW_HEIGHT * (len(arm) + len(whole)) + MARK_HEIGHT * len(marks)
    height = max(230.0, 46.0 + rows)
    flat = _project_skeleton(bones, np.asarray(arm.gravity))
    scale, shift = _fit_to_picture(flat.path, height)
    content = _draw_base(flat.path[0] * scale + shift) + _draw_links(flat.path * scale + shift)
    content += "".join(
        _draw_joint(
            flat.centres[index] * scale + shift,
            flat.axes[index],
            marks.get(index + 1),
            scale * _largest_extent(flat.path),
        )
        for index in reversed(range(len(arm)))
    )
    content += _draw_names(arm, flat.centres * scale + shift, marks, height) + _draw_whole_robot(whole, height)
    named = [f"{joint_in_words(arm, joint)}: {mark.text}" for joint, mark in sorted(marks.items())]
    guilty = ", ".join(named) or "no joint is marked"
    return svg_picture(content, PICTURE_WIDTH, height, f"The arm {arm.name} as a line drawing; {guilty}")


def _project_skeleton(bones: Skeleton, gravity: Array) -> Skeleton:
    """Seen from a side that shows most of it, with up against gravity: (points, 2), y downwards."""
    length = float(np.linalg.norm(gravity))
    up = -gravity / length if length > MIN_LENGTH else np.array([0.0, 0.0, 1.0])
    first = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    views = [_view_matrix(up, first, second, angle) for angle in np.linspace(0, 2 * np.pi, 24, endpoint=False)]
    best = max(views, key=lambda view: visible_extent(bones.path @ view))
    return Skeleton(bones.path @ best, bones.centres @ best, bones.axes @ best)


def _view_matrix(up: Array, first: Array, second: Array, angle: float) -> Array:
    """Projection (3, 2) on a picture from that side, seen a little from above."""
    right = np.cos(angle) * first + np.sin(angle) * second
    towards = np.cross(right, up)
    upwards = np.cos(ELEVATION) * up - np.sin(ELEVATION) * towards
    return np.column_stack([right, -upwards])


def visible_extent(path: Array) -> float:
    """How much of the picture the corners (points, 2 or 3) take up: area or volume, about."""
    sizes = np.linalg.svd(path - path.mean(axis=0), compute_uv=False)
    return float(sizes[:2].prod() + np.ptp(path[:, 0]) * MIN_LENGTH)


def _largest_extent(path: Array) -> float:
    return max(float(np.max(np.ptp(path, axis=0))), MIN_LENGTH)


def _fit_to_picture(path: Array, height: float) -> tuple[float, Array]:
    """Scale and shift that bring the arm into the left part of the picture."""
    room = np.array([ARM_WIDTH - 50, height - 80])
    span = np.maximum(np.ptp(path, axis=0), MIN_LENGTH)
    scale = float(np.min(room / span)) if np.max(np.ptp(path, axis=0)) > MIN_LENGTH else 1.0
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    return scale, np.array([ARM_WIDTH / 2 + 6, height / 2]) - middle * scale


def _draw_base(point: Array) -> str:
    x, y = point
    marks = "".join(f"M{x + step:.1f} {y + 8:.1f}l-6 7" for step in (-12, -4, 4, 12, 18))
    return svg_element(
        "path", d=f"M{x - 16:.1f} {y + 8:.1f}h34{marks}", fill="none", stroke=palette.PALE, stroke_width=1.5
    )


def _draw_links(path: Array) -> str:
    corners = "L".join(f"{x:.1f} {y:.1f}" for x, y in path)
    tool = svg_element(
        "circle", cx=path[-1][0], cy=path[-1][1], r=3, fill=palette.BACK, stroke=palette.PALE, stroke_width=1.5
    )
    tubes = ((palette.PALE, 9.0), (palette.RULE, 6.5))  # a dark line under a pale one has a dark edge
    return "".join(_draw_tube(f"M{corners}", color, width) for color, width in tubes) + tool


def _draw_tube(path: str, color: str, width: float) -> str:
    return svg_element(
        "path", d=path, fill="none", stroke=color, stroke_width=width, stroke_linejoin="round", stroke_linecap="round"
    )


def _draw_joint(centre: Array, axis: Array, mark: JointMark | None, size: float) -> str:
    """The axle as a short bar, a ring round it where a finding is at the joint."""
    half = axis * AXLE_SHARE * size
    ends = f"M{centre[0] - half[0]:.1f} {centre[1] - half[1]:.1f}L{centre[0] + half[0]:.1f} {centre[1] + half[1]:.1f}"
    color = mark.color if mark else palette.MIDDLE
    out = svg_element("path", d=ends, stroke=color, stroke_width=8, stroke_linecap="round", fill="none")
    out += svg_element("circle", cx=centre[0], cy=centre[1], r=4.2, fill=palette.BACK, stroke=color, stroke_width=2)
    if mark:
        dash = "3 2" if mark.unknown else "none"
        out += svg_element(
            "circle",
            cx=centre[0],
            cy=centre[1],
            r=11,
            fill="none",
            stroke=color,
            stroke_width=2.4,
            stroke_dasharray=dash,
        )
    return out


def _draw_names(arm: Arm, centres: Array, marks: Mapping[int, JointMark], height: float) -> str:
    """One row a joint beside the arm, from the highest to the lowest, with a line to the joint.

    What is said of a joint stands under its name.
    """
    order = np.lexsort((np.arange(len(arm)), centres[:, 1]))
    steps = [ROW_HEIGHT + MARK_HEIGHT * (int(index) + 1 in marks) for index in order]
    rows = 30 + np.cumsum([0.0, *steps[:-1]]) + max(0.0, (height - 46 - sum(steps)) / 2)
    out = ""
    for row, index in zip(rows, order, strict=True):
        mark = marks.get(int(index) + 1)
        color, weight = (mark.color, "600") if mark else (palette.PALE, "400")
        x, y = centres[index]
        start = ARM_WIDTH + 12
        out += svg_element(
            "path",
            d=f"M{x:.1f} {y:.1f}L{start - 3:.1f} {row - 4:.1f}",
            fill="none",
            stroke=color,
            stroke_width=1.2 if mark else 0.6,
            stroke_dasharray="none" if mark else "1 3",
        )
        room = (PICTURE_WIDTH - start - 2) / (BOLD if mark else 1.0)
        name = shorten_text(joint_in_words(arm, int(index) + 1), room, 10.5)
        out += svg_text(name, start, row, 10.5, fill=color, font_weight=weight)
        if mark:
            out += svg_text(shorten_text(mark.text, room, 10.5), start, row + MARK_HEIGHT, 10.5, fill=color)
    return out


def _draw_whole_robot(texts: Sequence[str], height: float) -> str:
    rows = [height - 8 - ROW_HEIGHT * index for index in range(len(texts))][::-1]
    pairs = zip(rows, texts, strict=True)
    return "".join(
        svg_text(shorten_text(f"whole robot: {text}", PICTURE_WIDTH - 12), 6, row, 11, fill=palette.DARK_VERMILION)
        for row, text in pairs
    )
