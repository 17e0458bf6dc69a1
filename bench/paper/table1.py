"""Table 1: the D-H parameters and ranges of the built-in arm, against the printed ones."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from bench.page import markdown_table, page
from bench.paper.settings import Table1Settings
from bench.printed import Printed, PrintedJoint, times_pi
from bench.table import as_csv
from problem.robot_file import BUILT_IN, JointEntry, RobotFile
from problem.settings import validate
from problem.yaml_input import read_yaml

_LENGTHS = {"a_mm": "a (mm)", "d_mm": "d (mm)"}
_ANGLES = {"alpha": "alpha (deg)", "lower": "lower range (deg)", "upper": "upper range (deg)"}
_NOTE = """\
`printed` stands only where it differs from ours. The lengths and twists are the paper's. Its ranges are in radians;
that of joint 1 is printed as ±11π/22, half of the robot's ±11π/12, and those of joints 5 and 6 differ from the data
sheet too, which is what the built-in arm follows. `theta_offset` puts the joint zeros where the robot has them; the
paper has no such column."""


def table1(settings: Table1Settings, paper: Printed) -> dict[str, str]:
    """The files of Table 1. Raises InputError for an arm that is not built in or has other joints."""
    path = BUILT_IN / f"{settings.arm}.yaml"
    joints = validate(RobotFile, read_yaml(path), str(path)).joints
    table = pd.DataFrame(_rows(joints, paper))
    cells = [[f"{entry:g}" if isinstance(entry, float) else entry for entry in row] for row in table.to_numpy()]
    text = page(settings.name, markdown_table(list(table.columns), cells), _NOTE)
    return {f"{settings.name}.csv": as_csv(table), f"{settings.name}.md": text}


def deviations(arm: str, paper: Printed) -> list[str]:
    """What differs from the printed table, like `joint 1, upper range (deg): 165, printed 90`."""
    path = BUILT_IN / f"{arm}.yaml"
    rows = _rows(validate(RobotFile, read_yaml(path), str(path)).joints, paper)
    return [f"joint {r['joint']}, {r['quantity']}: {r['ours']:g}, printed {r['printed']}" for r in rows if r["printed"]]


def _rows(joints: tuple[JointEntry, ...], paper: Printed) -> list[dict[str, object]]:
    pairs = zip(joints, paper.table1, strict=True)
    return [
        {"joint": number, "quantity": name, "ours": ours, "printed": "" if np.isclose(ours, theirs) else f"{theirs:g}"}
        for number, (joint, row) in enumerate(pairs, start=1)
        for name, ours, theirs in _quantities(joint, row)
    ]


def _quantities(joint: JointEntry, row: PrintedJoint) -> Iterator[tuple[str, float, float]]:
    lower, upper = joint.position_limits or (-np.inf, np.inf)
    ours = {"a_mm": joint.a * 1e3, "d_mm": joint.d * 1e3, "alpha": joint.alpha, "lower": lower, "upper": upper}
    for key, name in _LENGTHS.items():
        yield name, round(ours[key], 9), float(getattr(row, key))
    for key, name in _ANGLES.items():
        yield name, _degrees(ours[key]), _degrees(times_pi(getattr(row, key)))


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), 6)
