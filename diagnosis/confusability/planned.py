"""A planned motion: from a CSV, from the runs of a recording, or a best trajectory known by its name."""

import json
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from problem.arm import Arm
from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.motion import Motion
from problem.registry import parse_problem
from problem.settings import nearest
from problem.trajectory import instants
from recordings.differentiate import differentiate
from recordings.load import load_recording
from recordings.run import Array
from recordings.table import read_table

RATE_HZ = 250.0  # a sparser motion is filled in by splines
RECORDS = Path("results/best_known.json")


@dataclass(frozen=True, eq=False)
class Planned:
    """name: for the card. time: (samples,), s, even. motion: (samples, joints), SI."""

    name: str
    time: Array
    motion: Motion

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def planned_motions(trajectory: str, arm: Arm, records: Path = RECORDS) -> tuple[Planned, ...]:
    """The motions of a CSV file (t, q1 .., SI), of a recording folder, or of a record of best_known.json.

    Raises InputError, in one line, where there is none of that name or where it does not fit the arm.
    """
    path = Path(trajectory)
    if path.is_dir():
        found = _recorded(path)
    elif path.suffix.lower() == ".csv":
        found = (_from_csv(path, len(arm)),)
    else:
        found = (_known(trajectory, records),)
    for each in found:
        if each.motion.joints != len(arm):
            joints = f"{each.motion.joints} joints, {arm.name} has {len(arm)}"
            raise InputError(f"{each.name} moves {joints}")
    return found


def _recorded(folder: Path) -> tuple[Planned, ...]:
    signals = [differentiate(run) for run in load_recording(folder).runs]
    return tuple(Planned(each.run.name, each.run.time - each.run.time[0], each.motion) for each in signals)


def _from_csv(path: Path, joints: int) -> Planned:
    """Positions of a file at even stamps; velocities and accelerations from their quintic spline."""
    table = read_table(path)
    names = ["t", *(f"q{number}" for number in range(1, joints + 1))]
    values = table.columns(names, "time and position, in s and rad or m")
    if len(values) < 10 or not np.isfinite(values).all() or np.any(np.diff(values[:, 0]) <= 0):
        raise InputError(f"{path}: should have ten rows or more of finite numbers, with t increasing")
    time, position = values[:, 0] - values[0, 0], values[:, 1:]
    rate = max(RATE_HZ, 1 / float(np.median(np.diff(time))))
    even = np.linspace(0.0, time[-1], round(time[-1] * rate) + 1)
    spline = make_interp_spline(time, position, k=5)
    return Planned(path.name, even, Motion(spline(even), spline(even, 1), spline(even, 2)))


def _known(name: str, records: Path) -> Planned:
    known = json.loads(records.read_text(encoding="utf-8"))["problems"] if records.is_file() else {}
    if name not in known:
        hint = nearest(name, list(known))
        raise InputError(f"'{name}' is no CSV file, no recording folder, and no trajectory of {records}: {hint}")
    record = known[name]
    problem = parse_problem(record["settings"], f"{records}, {name}").build()
    if not isinstance(problem, ExcitationProblem):
        raise InputError(f"{records}, {name}: a trajectory in shifted coordinates cannot be taken")
    point = np.array([record["coefficients"][key] for key in problem.trajectory.names])
    time = instants(problem.duration, round(problem.duration * RATE_HZ) + 1)
    return Planned(name, time, problem.trajectory.motions(point[None], time).motion.select(np.intp(0)))
