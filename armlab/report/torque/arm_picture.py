"""A line drawing of the arm from its kinematics, in a recorded posture, with the affected joints marked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from markupsafe import Markup

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.common.report.charts import (
    CHART_WIDTH,
    shorten_text,
    svg_element,
    svg_picture,
    svg_text,
    wrap_text,
)
from problem.arm import Arm
from problem.joint_words import joint_in_words

PICTURE_WIDTH = CHART_WIDTH
NAME_SIZE, ROW_HEIGHT = 11.5, 18.0  # px: letters of a joint's name, and the height of its row
CAUSE_SIZE, CAUSE_HEIGHT = 11.0, 14.0  # px: the same of a line that says what was found there
ARM_WIDTH = 128.0  # px: width of the arm itself; the names stand beside it
NAMES_START = ARM_WIDTH + 12  # px
BOLD = 1.1  # width of bold letters over that of others, about
MIN_ARM_HEIGHT, MARGIN = 170.0, 8.0  # px
ELEVATION = np.deg2rad(18)
AXLE_SHARE = 0.045  # of the arm's size: half the length of a joint's axle
MIN_LENGTH = 1e-9


@dataclass(frozen=True)
class JointMark:
    """What was found at a joint, the largest cause first. unknown: no effect of the library explains all of it."""

    causes: tuple[str, ...]
    unknown: bool = False

    @property
    def text(self) -> str:
        """All causes in their order."""
        return ", ".join(self.causes)

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
    lines = {joint: wrap_text(mark.text, PICTURE_WIDTH - NAMES_START - 2, CAUSE_SIZE) for joint, mark in marks.items()}
    notes = [line for text in whole for line in wrap_text(f"whole robot: {text}", PICTURE_WIDTH - 12, CAUSE_SIZE)]
    names_height = ROW_HEIGHT * len(arm) + CAUSE_HEIGHT * sum(map(len, lines.values()))
    room = max(MIN_ARM_HEIGHT, names_height)
    height = room + CAUSE_HEIGHT * len(notes) + 2 * MARGIN
    flat = _project_skeleton(bones, np.asarray(arm.gravity))
    scale, shift = _fit_to_picture(flat.path, room)
    content = _draw_base(flat.path[0] * scale + shift) + _draw_links(flat.path * scale + shift)
    content += "".join(
        _draw_joint(
            flat.centres[index] * scale + shift,
            flat.axes[index],
            marks.get(index + 1),
            scale * max(float(np.max(np.ptp(flat.path, axis=0))), MIN_LENGTH),
        )
        for index in reversed(range(len(arm)))
    )
    first_row = MARGIN + NAME_SIZE + (room - names_height) / 2
    content += _draw_names(arm, flat.centres * scale + shift, marks, lines, first_row) + _draw_notes(notes, height)
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


def _fit_to_picture(path: Array, height: float) -> tuple[float, Array]:
    """Scale and shift that bring the arm into the left part of the picture, of that height, below the margin."""
    room = np.array([ARM_WIDTH - 42, height - 40])
    span = np.maximum(np.ptp(path, axis=0), MIN_LENGTH)
    scale = float(np.min(room / span)) if np.max(np.ptp(path, axis=0)) > MIN_LENGTH else 1.0
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    return scale, np.array([ARM_WIDTH / 2, MARGIN + height / 2]) - middle * scale


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


def _draw_names(
    arm: Arm, centres: Array, marks: Mapping[int, JointMark], lines: Mapping[int, Sequence[str]], first_row: float
) -> str:
    """The joints beside the arm, from the highest to the lowest, each with a line to it and its causes below its name.

    lines: the causes by joint, from 1. first_row: where the first name stands, px from above.
    """
    out, row = "", first_row
    for index in np.lexsort((np.arange(len(arm)), centres[:, 1])).tolist():
        mark = marks.get(index + 1)
        color, weight = (mark.color, "600") if mark else (palette.PALE, "400")
        x, y = centres[index]
        out += svg_element(
            "path",
            d=f"M{x:.1f} {y:.1f}L{NAMES_START - 3:.1f} {row - 4:.1f}",
            fill="none",
            stroke=color,
            stroke_width=1.2 if mark else 0.6,
            stroke_dasharray="none" if mark else "1 3",
        )
        room = (PICTURE_WIDTH - NAMES_START - 2) / (BOLD if mark else 1.0)
        name = shorten_text(joint_in_words(arm, index + 1), room, NAME_SIZE)
        out += svg_text(name, NAMES_START, row, NAME_SIZE, fill=color, font_weight=weight)
        for line in lines.get(index + 1, ()):
            row += CAUSE_HEIGHT
            out += svg_text(line, NAMES_START, row, CAUSE_SIZE)
        row += ROW_HEIGHT
    return out


def _draw_notes(lines: Sequence[str], height: float) -> str:
    """What concerns the robot as a whole, below the arm."""
    rows = [height - MARGIN - CAUSE_HEIGHT * index for index in range(len(lines))][::-1]
    pairs = zip(rows, lines, strict=True)
    return "".join(svg_text(line, 6, row, CAUSE_SIZE, fill=palette.DARK_VERMILION) for row, line in pairs)
