"""From the raw files of the public recordings to drafts: names, units, gears; the numbers stay as recorded."""

from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import loadmat

from recordings.imports.ros import read_bag
from recordings.public.registry import PUBLIC
from recordings.run import Array, Role
from recordings.write import Draft, DraftRun, Keys

IDENTIFY_SHARE = 0.6  # of a single run; the rest validates
TX40_RATE_HZ, TX40_MOTION_S = 5000, 7.5
TX40_GEARS = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
# the driver counts from the arm stretched out level, the D-H table of the robot file from the arm upright:
# shoulder lift and first wrist joint of Universal Robots stand at -90 deg there
UR10_ZEROS = (0.0, np.pi / 2, 0.0, np.pi / 2, 0.0, 0.0)
KUKA_GEARS = (256.86, 267.43, 252.33, 221.0, 239.62, 154.32)


def kuka_kr300(*paths: Path) -> Draft:
    """KUKA KR300: motor encoders, second encoders on axes 1 to 3, motor torques to be geared up."""
    columns: Keys = {
        "time": "t",
        "position": _numbered("q", 6),
        "torque": _numbered("motor_torque", 6),
        "velocity": _numbered("qd", 6),
        "link_position": _numbered("link_q", 6),
        "reference_position": _numbered("ref_q", 6),
    }
    units: Keys = {"time": "s", "position": "deg", "torque": "N.m", "velocity": "deg/s"}
    units |= {"link_position": "deg", "reference_position": "deg"}
    roles: tuple[Role, ...] = ("identify", "validate", "validate")
    runs = tuple(_kuka_run(path, role, _names(columns)) for path, role in zip(paths, roles, strict=True))
    gears = {"transmission": {"torque": np.diag(KUKA_GEARS).tolist()}, "sample_rate_hz": 250.0}
    return Draft("kuka-kr300", columns, units, runs, gears, _source("kuka-kr300"))


def _kuka_run(path: Path, role: Role, names: tuple[str, ...]) -> DraftRun:
    recorded = loadmat(path, simplify_cells=True)["rec"]
    link = recorded["act_pos_se_deg"].T.copy()
    link[:, 3:] = np.nan  # axes 4 to 6 have no second encoder; the file holds zeros
    signals = ["act_pos_mot_deg", "act_torque_abs_nm", "act_vel_mot_deg_per_s"]
    blocks = [recorded["time_cont"], *(recorded[name].T for name in signals), link, recorded["ref_pos_deg"].T]
    return DraftRun(f"{path.stem}.csv", role, names, np.column_stack(blocks))


def emps(identify: Path, validate: Path) -> Draft:
    """EMPS: carriage position, and the drive's voltage with its gain in N/V."""
    columns: Keys = {"time": "t", "position": ("q",), "torque": ("voltage",), "reference_position": ("ref_q",)}
    units: Keys = {"time": "s", "position": "m", "torque": "V", "reference_position": "m"}
    contents = [loadmat(path, simplify_cells=True) for path in (identify, validate)]
    files: tuple[tuple[str, Role], ...] = (("identify.csv", "identify"), ("pulses.csv", "validate"))
    runs = tuple(
        DraftRun(file, role, _names(columns), np.column_stack([raw[key] for key in ("t", "qm", "vir", "qg")]))
        for (file, role), raw in zip(files, contents, strict=True)
    )
    others = {"gains": [float(contents[0]["gtau"])], "sample_rate_hz": 1000.0}
    return Draft("emps", columns, units, runs, others, _source("emps"))


def staubli_tx40(positions: Path, torques: Path) -> Draft:
    """TX40: motor angles and motor torques; axes 5 and 6 are coupled, zeros of axes 2 and 3 shifted."""
    angles, efforts = pd.read_csv(positions).to_numpy(float), pd.read_csv(torques).to_numpy(float)
    time = np.arange(len(angles)) / TX40_RATE_HZ
    moving = round(TX40_MOTION_S * TX40_RATE_HZ)
    columns: Keys = {"time": "t", "position": _numbered("motor_q", 6), "torque": _numbered("motor_torque", 6)}
    gears, torque = np.diag(TX40_GEARS), np.diag(TX40_GEARS)
    gears[5, 4] = torque[4, 5] = TX40_GEARS[5]
    transmission = {
        "position": np.linalg.inv(gears).tolist(),
        "offset": [0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0],
        "torque": torque.tolist(),
    }
    others = {"transmission": transmission, "sample_rate_hz": float(TX40_RATE_HZ)}
    source = (*_source("staubli-tx40"), f"The motion ends at about {TX40_MOTION_S} s; what follows is left out.")
    runs = _halves(_names(columns), np.column_stack([time, angles, efforts])[:moving])
    units: Keys = {"time": "s", "position": "rad", "torque": "N.m"}
    return Draft("staubli-tx40", columns, units, runs, others, source)


def unisa(name: str, path: Path) -> Draft:
    """UR10 or Panda of the University of Salerno: a bag of joint states, efforts in N m."""
    table = read_bag(path)
    joints = [column.removeprefix("position_") for column in table.names if column.startswith("position_")]
    columns: Keys = {"time": "t"}
    for signal, prefix in (("position", "position"), ("torque", "effort"), ("velocity", "velocity")):
        columns[signal] = tuple(f"{prefix}_{joint}" for joint in joints)
    units: Keys = {"time": "s", "position": "rad", "torque": "N.m", "velocity": "rad/s"}
    others = {"transmission": {"offset": list(UR10_ZEROS)}} if name == "unisa-ur10" else {}
    return Draft(name, columns, units, _halves(table.names, table.values), others, _source(name))


def _halves(names: tuple[str, ...], values: Array) -> tuple[DraftRun, DraftRun]:
    """The first part of a single run to identify, the rest to validate."""
    cut = round(IDENTIFY_SHARE * len(values))
    first = DraftRun("identify.csv", "identify", names, values[:cut])
    return first, DraftRun("validate.csv", "validate", names, values[cut:])


def _numbered(name: str, joints: int) -> tuple[str, ...]:
    return tuple(f"{name}{joint}" for joint in range(1, joints + 1))


def _names(columns: Keys) -> tuple[str, ...]:
    return tuple(name for names in columns.values() for name in ((names,) if isinstance(names, str) else names))


def _source(name: str) -> tuple[str, ...]:
    return (f"Public recording {name}, from {PUBLIC[name].source}, licence {PUBLIC[name].licence}.",)


CONVERTERS: dict[str, Callable[..., Draft]] = {
    "kuka-kr300": kuka_kr300,
    "emps": emps,
    "staubli-tx40": staubli_tx40,
    "unisa-ur10": partial(unisa, "unisa-ur10"),
    "unisa-panda": partial(unisa, "unisa-panda"),
}
