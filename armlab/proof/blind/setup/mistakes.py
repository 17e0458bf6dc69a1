"""Mistakes as people make them, put into the files of a recording folder."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from armlab.common.arrays import Array
from armlab.common.settings import read_yaml, to_plain_data
from armlab.recordings.units import SIGNAL_QUANTITIES
from problem.arm import Arm
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from problem.robot_file import BUILT_IN_FOLDER, RobotFile

EFFECTS = (
    "torque_sign",
    "joint_direction",
    "channel_swap",
    "unit_error",
    "gear_ratio",
    "encoder_offset",
    "base_tilt",
    "gravity_compensated_torque",
    "dh_convention",
    "inertia_reference",
    "link_data_error",
    "clock_error",
    "time_delay",
    "channel_skew",
)
NEED_LINKS = ("gravity_compensated_torque", "inertia_reference", "link_data_error")
PUT_ORDER = {"gravity_compensated_torque": 0, "channel_swap": 2}  # others are put in between
NEED_PAIRS = ("channel_swap", "channel_skew")
POSITION_COLUMNS = ("position", "velocity", "reference_position", "reference_velocity")


@dataclass(frozen=True)
class Injected:
    """One mistake. joint: from 1, None for the whole robot. joints: an exchanged pair. size: of its number."""

    effect: str
    joint: int | None = None
    joints: tuple[int, ...] = ()
    form: str = ""
    size: float = 0.0
    gravity: tuple[float, ...] = ()


def draw_mistake(rng: np.random.Generator, effect: str, arm: Arm) -> Injected | None:
    """A mistake of an effect at a random place of an arm; None where the arm has no place for it."""
    joints = len(arm)
    if (effect in NEED_LINKS and arm.links is None) or (effect in NEED_PAIRS and joints < 2):
        return None
    joint = int(rng.integers(joints)) + 1
    turning = arm.joints[joint - 1].kind == "revolute"
    sign = float(rng.choice([-1, 1]))
    if effect in ("torque_sign", "link_data_error"):
        return Injected(effect, joint, form="centre_sign" if effect == "link_data_error" else "")
    if effect == "joint_direction":
        return Injected(effect, joint, form=str(rng.choice(["position", "position and torque"])))
    if effect == "channel_swap":
        pair = sorted(int(each) + 1 for each in rng.choice(joints, 2, replace=False))
        return Injected(effect, joints=tuple(pair), form=str(rng.choice(["torque", "position", "position and torque"])))
    if effect == "unit_error":
        form = str(rng.choice(["position", "torque"]))
        whole = bool(rng.random() < 0.5) and (form == "position" or arm.links is not None)
        factor = 1000.0 if form == "torque" or not turning else 180 / np.pi
        return Injected(effect, None if whole and joints > 1 else joint, form=form, size=factor)
    if effect == "gear_ratio":
        return Injected(effect, joint, size=float(rng.uniform(30, 160))) if turning else None
    if effect == "encoder_offset":
        angle = float(rng.choice([90, 180, -90])) if rng.random() < 0.5 else sign * float(rng.uniform(12, 170))
        return Injected(effect, joint, size=float(np.deg2rad(angle))) if turning else None
    if effect == "base_tilt":
        direction = rng.normal(size=3)
        return Injected(effect, gravity=tuple((9.81 * direction / np.linalg.norm(direction)).tolist()))
    if effect == "clock_error":
        return Injected(effect, size=float(np.exp(sign * rng.uniform(0.1, 0.7))))
    if effect in ("time_delay", "channel_skew"):
        return Injected(effect, joint if effect == "channel_skew" else None, size=float(rng.uniform(0.03, 0.4)))
    return Injected(effect, form="inertia" if effect == "inertia_reference" else "")


@dataclass
class _Files:
    """The files of a recording folder in memory."""

    folder: Path
    settings: dict[str, Any]
    robot: dict[str, Any]
    tables: dict[str, pd.DataFrame]

    @property
    def arm(self) -> Arm:
        return RobotFile.model_validate(_tuples(self.robot)).build()

    def si_factors(self, signal: str) -> Array:
        """From the numbers of a signal to SI units, (channels,) or one for all."""
        given = (self.settings.get("units") or {}).get(signal)
        return (
            np.ones(1)
            if given is None
            else np.array([SIGNAL_QUANTITIES[signal].units[each].factor for each in np.ravel(given)])
        )

    def scale(self, signal: str, joint: int | None, factor: float) -> None:
        """Numbers of one joint, or of all, times a factor: rows of the transmission where there is one."""
        matrix = (self.settings.get("transmission") or {}).get(signal)
        for name in POSITION_COLUMNS if signal == "position" else (signal, "current"):
            columns = self.settings["columns"].get(name)
            if columns is None or (matrix is not None and name in ("position", "torque")):
                continue
            for table in self.tables.values():
                own = columns if joint is None else [columns[joint - 1]]
                table[own] *= factor
        if matrix is not None:
            rows = range(len(matrix)) if joint is None else [joint - 1]
            for row in rows:
                matrix[row] = [factor * value for value in matrix[row]]


def inject(folder: Path, mistakes: tuple[Injected, ...], true_arm: Arm | None = None) -> None:
    """Puts mistakes into the files of a folder. true_arm: whose gravity a compensated torque leaves out.

    Gravity comes off first, while the files still say how they are to be read. Channels are exchanged last, so that the
    place of another mistake is the joint whose channel has it.
    """
    files = _read(folder)
    for mistake in sorted(mistakes, key=lambda each: PUT_ORDER.get(each.effect, 1)):
        _put(files, mistake, true_arm)
    _write(files)


def _put(files: _Files, mistake: Injected, true_arm: Arm | None) -> None:
    columns, joint = files.settings["columns"], mistake.joint
    effect = mistake.effect
    if effect == "torque_sign":
        files.scale("torque", joint, -1.0)
    elif effect == "joint_direction":
        files.scale("position", joint, -1.0)
        if mistake.form != "position":
            files.scale("torque", joint, -1.0)
    elif effect == "channel_swap":
        signals = [*(POSITION_COLUMNS if mistake.form != "torque" else ())]
        signals += ["torque", "current"] if mistake.form != "position" else []
        first, second = (each - 1 for each in mistake.joints)
        for name in signals:
            if columns.get(name) is not None:
                names = list(columns[name])
                names[first], names[second] = names[second], names[first]
                columns[name] = names
    elif effect == "unit_error":
        files.scale(mistake.form, joint, mistake.size)
    elif effect == "gear_ratio":
        files.scale("position", joint, mistake.size)
        files.scale("torque", joint, 1 / mistake.size)
    elif effect == "encoder_offset":
        given = files.settings.setdefault("transmission", {})
        zeros = list(given.get("offset") or [0.0] * len(files.robot["joints"]))
        zeros[(joint or 1) - 1] -= mistake.size
        given["offset"] = zeros
    elif effect == "base_tilt":
        files.robot["gravity"] = list(mistake.gravity)
    elif effect == "dh_convention":
        files.robot["dh_convention"] = "modified" if files.robot["dh_convention"] == "standard" else "standard"
    elif effect in ("inertia_reference", "link_data_error"):
        _change_links(files, mistake)
    else:
        _change_torque_or_time(files, mistake, true_arm)


def _change_links(files: _Files, mistake: Injected) -> None:
    for number, entry in enumerate(files.robot["links"], 1):
        moment = np.array(entry["first_moment"])
        if mistake.effect == "link_data_error":
            entry["first_moment"] = (-moment if number == mistake.joint else moment).tolist()
        elif entry["mass"] > 0:
            centre = moment / entry["mass"]
            own = entry["mass"] * (centre @ centre * np.eye(3) - np.outer(centre, centre))
            about = np.array(entry["inertia"]) - own[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]]
            entry["inertia"] = about.tolist()


def _change_torque_or_time(files: _Files, mistake: Injected, true_arm: Arm | None) -> None:
    columns = files.settings["columns"]
    time, torques = columns["time"], columns.get("torque") or columns["current"]
    for table in files.tables.values():
        if mistake.effect == "clock_error":
            table[time] *= mistake.size
            files.settings.pop("sample_rate_hz", None)
        elif mistake.effect == "gravity_compensated_torque":
            table[list(torques)] -= _gravity_of_channels(files, table, true_arm or files.arm)
        else:
            late = torques if mistake.joint is None else [torques[mistake.joint - 1]]
            for name in late:
                table[name] = np.interp(table[time] - mistake.size, table[time], table[name])


def _gravity_of_channels(files: _Files, table: pd.DataFrame, arm: Arm) -> Array:
    """The torque of gravity as the torque's channels hold it, (rows, channels)."""
    settings = files.settings
    given, columns, ones = settings.get("transmission") or {}, settings["columns"], np.ones(len(arm))
    matrices = [np.array(given.get(name) or np.diag(ones)) for name in ("position", "torque")]
    signal = "torque" if columns.get("torque") else "current"
    to_joint, to_torque = (files.si_factors(name) for name in ("position", signal))
    position = (table[list(columns["position"])].to_numpy() * to_joint) @ matrices[0].T
    position += np.array(given.get("offset") or 0 * ones)
    still = np.zeros_like(position)
    loads = rigid_body_torque(arm, Motion(position, still, still))
    return np.asarray(np.linalg.solve(matrices[1], loads.T).T / np.array(settings.get("gains") or ones) / to_torque)


def _read(folder: Path) -> _Files:
    settings = read_yaml(folder / "recording.yaml")
    beside = folder / str(settings["robot"])
    robot = read_yaml(beside if beside.is_file() else BUILT_IN_FOLDER / f"{settings['robot']}.yaml")
    tables = {}
    for run in settings["runs"]:
        path = folder / run["file"]
        tables[run["file"]] = pd.read_parquet(path) if path.suffix == ".parquet" else pd.read_csv(path)
    return _Files(folder, settings, robot, tables)


def _write(files: _Files) -> None:
    files.settings["robot"] = "robot.yaml"
    for name, content in (("recording.yaml", files.settings), ("robot.yaml", files.robot)):
        text = yaml.safe_dump(to_plain_data(content), sort_keys=False, default_flow_style=None, width=110)
        (files.folder / name).write_text(text, encoding="utf-8")
    for name, table in files.tables.items():
        path = files.folder / name
        if path.suffix == ".parquet":
            table.to_parquet(path, index=False)
        else:
            table.to_csv(path, index=False, lineterminator="\n")


def _tuples(data: Any) -> Any:
    if isinstance(data, dict):
        return {key: _tuples(value) for key, value in data.items()}
    return tuple(_tuples(each) for each in data) if isinstance(data, list) else data
