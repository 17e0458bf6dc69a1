"""A line drawing of the arm from its kinematics, in the posture of the recording, with the guilty joints marked."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from diagnosis.report.looks import GUILTY, INNOCENT, UNKNOWN
from diagnosis.report.svg import PALE, picture, shortened, tag, words
from problem.arm import Arm
from recordings.run import Array

WIDTH, ROW = 372.0, 17.0
DRAWN = 168.0  # px: width of the arm itself; the names stand beside it
ELEVATION = np.deg2rad(18)
BARREL = 0.045  # of the arm's size: half the length of a joint's axle
TINY = 1e-9


@dataclass(frozen=True)
class Mark:
    """What is said of a joint. unknown: no effect of the library explains it."""

    text: str
    unknown: bool = False

    @property
    def color(self) -> str:
        """Of the joint and its name."""
        return UNKNOWN if self.unknown else GUILTY


@dataclass(frozen=True, eq=False)
class Skeleton:
    """path: corners of the links (points, 3); centres, axes: (joints, 3) of the joints; m, in the base frame."""

    path: Array
    centres: Array
    axes: Array


def skeleton(arm: Arm, position: Array) -> Skeleton:
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


def telling_position(arm: Arm, positions: Array) -> Array:
    """The posture (joints,) among some (rows, joints) in which the arm hides least of itself."""
    return np.asarray(max(positions, key=lambda position: spread(skeleton(arm, position).path)))


def arm_picture(arm: Arm, position: Array, marks: Mapping[int, Mark], whole: Sequence[str] = ()) -> str:
    """The arm as SVG. marks: by joint, from 1. whole: what concerns the robot as a whole."""
    bones = skeleton(arm, position)
    height = max(230.0, 46.0 + ROW * (len(arm) + len(whole)))
    flat = _projected(bones, np.asarray(arm.gravity))
    scale, shift = _fitted(flat.path, height)
    content = _base(flat.path[0] * scale + shift) + _links(flat.path * scale + shift)
    content += "".join(
        _joint(flat.centres[index] * scale + shift, flat.axes[index], marks.get(index + 1), scale * _size(flat.path))
        for index in reversed(range(len(arm)))
    )
    content += _names(arm, flat.centres * scale + shift, marks, height) + _whole(whole, height)
    guilty = ", ".join(f"joint {joint}: {mark.text}" for joint, mark in sorted(marks.items())) or "no joint is marked"
    return picture(content, WIDTH, height, f"The arm {arm.name} as a line drawing; {guilty}")


def _projected(bones: Skeleton, gravity: Array) -> Skeleton:
    """Seen from a side that shows most of it, with up against gravity: (points, 2), y downwards."""
    length = float(np.linalg.norm(gravity))
    up = -gravity / length if length > TINY else np.array([0.0, 0.0, 1.0])
    first = np.cross(up, [1.0, 0.0, 0.0] if abs(up[0]) < 0.9 else [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first)
    second = np.cross(up, first)
    views = [_view(up, first, second, angle) for angle in np.linspace(0, 2 * np.pi, 24, endpoint=False)]
    best = max(views, key=lambda view: spread(bones.path @ view))
    return Skeleton(bones.path @ best, bones.centres @ best, bones.axes @ best)


def _view(up: Array, first: Array, second: Array, angle: float) -> Array:
    """Projection (3, 2) on a picture from that side, seen a little from above."""
    right = np.cos(angle) * first + np.sin(angle) * second
    towards = np.cross(right, up)
    upwards = np.cos(ELEVATION) * up - np.sin(ELEVATION) * towards
    return np.column_stack([right, -upwards])


def spread(path: Array) -> float:
    """How much of the picture the corners (points, 2 or 3) take up: area or volume, about."""
    sizes = np.linalg.svd(path - path.mean(axis=0), compute_uv=False)
    return float(sizes[:2].prod() + np.ptp(path[:, 0]) * TINY)


def _size(path: Array) -> float:
    return max(float(np.max(np.ptp(path, axis=0))), TINY)


def _fitted(path: Array, height: float) -> tuple[float, Array]:
    """Scale and shift that bring the arm into the left part of the picture."""
    room = np.array([DRAWN - 50, height - 80])
    span = np.maximum(np.ptp(path, axis=0), TINY)
    scale = float(np.min(room / span)) if np.max(np.ptp(path, axis=0)) > TINY else 1.0
    middle = (path.max(axis=0) + path.min(axis=0)) / 2
    return scale, np.array([DRAWN / 2 + 6, height / 2]) - middle * scale


def _base(point: Array) -> str:
    x, y = point
    marks = "".join(f"M{x + step:.1f} {y + 8:.1f}l-6 7" for step in (-12, -4, 4, 12, 18))
    return tag("path", d=f"M{x - 16:.1f} {y + 8:.1f}h34{marks}", fill="none", stroke=PALE, stroke_width=1.5)


def _links(path: Array) -> str:
    corners = "L".join(f"{x:.1f} {y:.1f}" for x, y in path)
    tool = tag("circle", cx=path[-1][0], cy=path[-1][1], r=3, fill="#fff", stroke=PALE, stroke_width=1.5)
    tubes = (("#5b6570", 9.0), ("#d9dee4", 6.5))  # a dark line under a pale one has a dark edge
    return "".join(_tube(f"M{corners}", color, width) for color, width in tubes) + tool


def _tube(path: str, color: str, width: float) -> str:
    return tag("path", d=path, fill="none", stroke=color, stroke_width=width, stroke_linejoin="round",
               stroke_linecap="round")  # fmt: skip


def _joint(centre: Array, axis: Array, mark: Mark | None, size: float) -> str:
    """The axle as a short bar, a ring round it where the joint is guilty."""
    half = axis * BARREL * size
    ends = f"M{centre[0] - half[0]:.1f} {centre[1] - half[1]:.1f}L{centre[0] + half[0]:.1f} {centre[1] + half[1]:.1f}"
    color = mark.color if mark else INNOCENT
    out = tag("path", d=ends, stroke=color, stroke_width=8, stroke_linecap="round", fill="none")
    out += tag("circle", cx=centre[0], cy=centre[1], r=4.2, fill="#fff", stroke=color, stroke_width=2)
    if mark:
        dash = "3 2" if mark.unknown else "none"
        out += tag("circle", cx=centre[0], cy=centre[1], r=11, fill="none", stroke=color, stroke_width=2.4,
                   stroke_dasharray=dash)  # fmt: skip
    return out


def _names(arm: Arm, centres: Array, marks: Mapping[int, Mark], height: float) -> str:
    """One row a joint beside the arm, from the highest to the lowest, with a line to the joint."""
    order = np.lexsort((np.arange(len(arm)), centres[:, 1]))
    rows = 30 + ROW * np.arange(len(arm)) + max(0.0, (height - 46 - ROW * len(arm)) / 2)
    out = ""
    for row, index in zip(rows, order, strict=True):
        mark = marks.get(int(index) + 1)
        color, weight = (mark.color, "600") if mark else (PALE, "400")
        x, y = centres[index]
        start = DRAWN + 12
        out += tag("path", d=f"M{x:.1f} {y:.1f}L{start - 3:.1f} {row - 4:.1f}", fill="none", stroke=color,
                   stroke_width=1.2 if mark else 0.6, stroke_dasharray="none" if mark else "1 3")  # fmt: skip
        text = f"{index + 1}  {mark.text}" if mark else f"{index + 1}  {arm.joints[index].name}"
        out += words(shortened(text, WIDTH - start - 2, 10.5), start, row, 10.5, fill=color, font_weight=weight)
    return out


def _whole(texts: Sequence[str], height: float) -> str:
    rows = [height - 8 - ROW * index for index in range(len(texts))][::-1]
    pairs = zip(rows, texts, strict=True)
    return "".join(words(shortened(f"whole robot: {text}", WIDTH - 12), 6, row, 11, fill=GUILTY) for row, text in pairs)
