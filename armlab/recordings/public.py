"""Public recordings of real arms: their addresses, and how their raw files are fetched and become recording folders."""

import hashlib
import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.io import loadmat

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.recording import Role
from armlab.recordings.recording_file import Draft, DraftRun, Keys, write_recording

GITHUB = "https://raw.githubusercontent.com"
KUKA = f"{GITHUB}/JonasWeigand/Robot_Identification/454c8e6d4f6f9a9ec0b2fcb10b4cb958ac702e55/data/recorded_trajectories"
EMPS = f"{GITHUB}/forgi86/sysid-neural-continuous/93afc131780fb1d5477472935a18ac8405683890/examples/EMPS/data"
STAUBLI = f"{GITHUB}/thanhndv212/figaroh-plus/53d6517a3dcbf383bff864b54132b9ce25f7f3e7/examples/staubli_TX40/data"
UNISA = f"{GITHUB}/unisa-acg/inverse-dynamics-solver/e67a57eceefa7db7959eba076b6afbce12fa2cd6"


@dataclass(frozen=True)
class RemoteFile:
    """One public file: the name of its local copy, where it is, and the SHA-256 of its content."""

    name: str
    address: str
    sha256: str


@dataclass(frozen=True)
class PublicRecording:
    """The raw files of one recording; `folder` is that of local copies, below ARMLAB_RECORDINGS."""

    folder: str
    source: str
    licence: str
    files: tuple[RemoteFile, ...]


PUBLIC_RECORDINGS = {
    "kuka-kr300": PublicRecording(
        "kuka_kr300",
        "JonasWeigand/Robot_Identification",
        "MIT",
        (
            RemoteFile(
                "run_A.mat",
                f"{KUKA}/2020-10-21%2010s%20FF%20A%2008ms/data.mat",
                "4c152c5b7f2c899731fdeebcf0d011cc103df72be19fac160caf47aa9b73ab75",
            ),
            RemoteFile(
                "run_B.mat",
                f"{KUKA}/2020-10-21%2010s%20FF%20B%2008ms/data.mat",
                "edeb35f65c4ec4bb697e757fc1e4e9668551b6fe7b2c3dbbb526d040dd8d5ce7",
            ),
            RemoteFile(
                "run_C.mat",
                f"{KUKA}/2020-10-21%2010s%20FF%20C%2008ms/data.mat",
                "c5d5688521ece941e6c4afd39643a01cd36ae8c7790342640277f8b15b5515b4",
            ),
        ),
    ),
    "emps": PublicRecording(
        "emps",
        "forgi86/sysid-neural-continuous",
        "Apache-2.0",
        (
            RemoteFile(
                "DATA_EMPS.mat",
                f"{EMPS}/DATA_EMPS.mat",
                "6cf6814ae14618795da0101aae2bb97ff0c6351b0501b5492751b02b07facf7e",
            ),
            RemoteFile(
                "DATA_EMPS_PULSES.mat",
                f"{EMPS}/DATA_EMPS_PULSES.mat",
                "0eab75bb1f6b16228ee78791343a88bf9bfd9a51036ac9807d7b5fc11c0e1704",
            ),
        ),
    ),
    "staubli-tx40": PublicRecording(
        "staubli_tx40",
        "thanhndv212/figaroh-plus",
        "Apache-2.0",
        (
            RemoteFile(
                "pos_read_data.csv",
                f"{STAUBLI}/pos_read_data.csv",
                "5cc1cecc1024ef0e331d0caba06f689456ab789ec3f1e904599c0a8be5c27bc8",
            ),
            RemoteFile(
                "curr_data.csv",
                f"{STAUBLI}/curr_data.csv",
                "f4592f4ba4db42f5d7625688986be25b575ca34d0504b27979ca6b0276bd3af9",
            ),
        ),
    ),
    "unisa-ur10": PublicRecording(
        "unisa_ur10_panda",
        "unisa-acg/inverse-dynamics-solver",
        "BSD-3-Clause",
        (
            RemoteFile(
                "ur10_exciting_trajectory.db3",
                f"{UNISA}/ur10_inverse_dynamics_solver/bagfiles/ur10_exciting_trajectory.db3",
                "14244fc39e9b42047039824f3c20ab984f9d1b28d5a67e9415cc1b3cc0ac3369",
            ),
        ),
    ),
    "unisa-panda": PublicRecording(
        "unisa_ur10_panda",
        "unisa-acg/inverse-dynamics-solver",
        "BSD-3-Clause",
        (
            RemoteFile(
                "panda_exciting_trajectory.db3",
                f"{UNISA}/franka_inria_inverse_dynamics_solver/bagfiles/panda_exciting_trajectory.db3",
                "6794c9dc89628d775bd77bfaee3ed73e0a7d7716401886e17e06d81ea3b7f299",
            ),
        ),
    ),
}


IDENTIFY_SHARE = 0.6  # of a single run; the rest validates
TX40_RATE_HZ, TX40_MOTION_S = 5000, 7.5
TX40_GEARS = np.array([32.0, 32.0, 45.0, -48.0, 45.0, 32.0])
# the driver counts from the arm stretched out level, the D-H table of the robot file from the arm upright:
# shoulder lift and first wrist joint of Universal Robots stand at -90 deg there
UR10_ZEROS = (0.0, np.pi / 2, 0.0, np.pi / 2, 0.0, 0.0)
KUKA_GEARS = (256.86, 267.43, 252.33, 221.0, 239.62, 154.32)


def convert_kuka_kr300(*paths: Path) -> Draft:
    """KUKA KR300: motor encoders, second encoders on axes 1 to 3, motor torques to be geared up."""
    columns: Keys = {
        "time": "t",
        "position": _numbered_names("q", 6),
        "torque": _numbered_names("motor_torque", 6),
        "velocity": _numbered_names("qd", 6),
        "link_position": _numbered_names("link_q", 6),
        "reference_position": _numbered_names("ref_q", 6),
    }
    units: Keys = {"time": "s", "position": "deg", "torque": "N.m", "velocity": "deg/s"}
    units |= {"link_position": "deg", "reference_position": "deg"}
    roles: tuple[Role, ...] = ("identify", "validate", "validate")
    runs = tuple(_make_kuka_run(path, role, _column_names(columns)) for path, role in zip(paths, roles, strict=True))
    gears = {"transmission": {"torque": np.diag(KUKA_GEARS).tolist()}, "sample_rate_hz": 250.0}
    return Draft("kuka-kr300", columns, units, runs, gears, _source_comment("kuka-kr300"))


def _make_kuka_run(path: Path, role: Role, names: tuple[str, ...]) -> DraftRun:
    recorded = loadmat(path, simplify_cells=True)["rec"]
    link = recorded["act_pos_se_deg"].T.copy()
    link[:, 3:] = np.nan  # axes 4 to 6 have no second encoder; the file holds zeros
    signals = ["act_pos_mot_deg", "act_torque_abs_nm", "act_vel_mot_deg_per_s"]
    blocks = [recorded["time_cont"], *(recorded[name].T for name in signals), link, recorded["ref_pos_deg"].T]
    return DraftRun(f"{path.stem}.csv", role, names, np.column_stack(blocks))


def convert_emps(identify: Path, validate: Path) -> Draft:
    """EMPS: carriage position, and the drive's voltage with its gain in N/V."""
    columns: Keys = {"time": "t", "position": ("q",), "torque": ("voltage",), "reference_position": ("ref_q",)}
    units: Keys = {"time": "s", "position": "m", "torque": "V", "reference_position": "m"}
    contents = [loadmat(path, simplify_cells=True) for path in (identify, validate)]
    files: tuple[tuple[str, Role], ...] = (("identify.csv", "identify"), ("pulses.csv", "validate"))
    runs = tuple(
        DraftRun(file, role, _column_names(columns), np.column_stack([raw[key] for key in ("t", "qm", "vir", "qg")]))
        for (file, role), raw in zip(files, contents, strict=True)
    )
    others = {"gains": [float(contents[0]["gtau"])], "sample_rate_hz": 1000.0}
    return Draft("emps", columns, units, runs, others, _source_comment("emps"))


def convert_staubli_tx40(positions: Path, torques: Path) -> Draft:
    """TX40: motor angles and motor torques; axes 5 and 6 are coupled, zeros of axes 2 and 3 shifted."""
    angles, efforts = pd.read_csv(positions).to_numpy(float), pd.read_csv(torques).to_numpy(float)
    time = np.arange(len(angles)) / TX40_RATE_HZ
    moving = round(TX40_MOTION_S * TX40_RATE_HZ)
    columns: Keys = {
        "time": "t",
        "position": _numbered_names("motor_q", 6),
        "torque": _numbered_names("motor_torque", 6),
    }
    gears, torque = np.diag(TX40_GEARS), np.diag(TX40_GEARS)
    gears[5, 4] = torque[4, 5] = TX40_GEARS[5]
    transmission = {
        "position": np.linalg.inv(gears).tolist(),
        "offset": [0.0, -np.pi / 2, np.pi / 2, 0.0, 0.0, 0.0],
        "torque": torque.tolist(),
    }
    others = {"transmission": transmission, "sample_rate_hz": float(TX40_RATE_HZ)}
    source = (
        *_source_comment("staubli-tx40"),
        f"The motion ends at about {TX40_MOTION_S} s; what follows is left out.",
    )
    runs = _split_run(_column_names(columns), np.column_stack([time, angles, efforts])[:moving])
    units: Keys = {"time": "s", "position": "rad", "torque": "N.m"}
    return Draft("staubli-tx40", columns, units, runs, others, source)


def convert_unisa(name: str, path: Path) -> Draft:
    """UR10 or Panda of the University of Salerno: a bag of joint states, efforts in N m."""
    table = read_bag(path)
    joints = [column.removeprefix("position_") for column in table.names if column.startswith("position_")]
    columns: Keys = {"time": "t"}
    for signal, prefix in (("position", "position"), ("torque", "effort"), ("velocity", "velocity")):
        columns[signal] = tuple(f"{prefix}_{joint}" for joint in joints)
    units: Keys = {"time": "s", "position": "rad", "torque": "N.m", "velocity": "rad/s"}
    others = {"transmission": {"offset": list(UR10_ZEROS)}} if name == "unisa-ur10" else {}
    return Draft(name, columns, units, _split_run(table.names, table.values), others, _source_comment(name))


def _split_run(names: tuple[str, ...], values: Array) -> tuple[DraftRun, DraftRun]:
    """The first part of a single run to identify, the rest to validate."""
    cut = round(IDENTIFY_SHARE * len(values))
    first = DraftRun("identify.csv", "identify", names, values[:cut])
    return first, DraftRun("validate.csv", "validate", names, values[cut:])


def _numbered_names(name: str, joints: int) -> tuple[str, ...]:
    return tuple(f"{name}{joint}" for joint in range(1, joints + 1))


def _column_names(columns: Keys) -> tuple[str, ...]:
    return tuple(name for names in columns.values() for name in ((names,) if isinstance(names, str) else names))


def _source_comment(name: str) -> tuple[str, ...]:
    return (
        f"Public recording {name}, from {PUBLIC_RECORDINGS[name].source}, licence {PUBLIC_RECORDINGS[name].licence}.",
    )


CONVERTERS: dict[str, Callable[..., Draft]] = {
    "kuka-kr300": convert_kuka_kr300,
    "emps": convert_emps,
    "staubli-tx40": convert_staubli_tx40,
    "unisa-ur10": partial(convert_unisa, "unisa-ur10"),
    "unisa-panda": partial(convert_unisa, "unisa-panda"),
}


LOCAL_COPIES_VARIABLE = "ARMLAB_RECORDINGS"


def local_copies() -> Path | None:
    """The folder that the environment variable ARMLAB_RECORDINGS names; None where it is unset or blank."""
    folder = os.environ.get(LOCAL_COPIES_VARIABLE, "").strip()
    return Path(folder) if folder else None


def fetch_recording(name: str, folder: Path) -> Path:
    """Writes a public recording into a new folder and returns its path.

    The raw files come from the folder that the environment variable ARMLAB_RECORDINGS names, else from their
    public address into the user's cache; a file with another SHA-256 is refused. Raises InputError for an
    unknown name, a file that cannot be had, and a folder that is not empty.
    """
    if name not in PUBLIC_RECORDINGS:
        raise InputError(f"unknown recording '{name}': {suggest_name(name, list(PUBLIC_RECORDINGS))}")
    files = [find_raw_file(PUBLIC_RECORDINGS[name], file) for file in PUBLIC_RECORDINGS[name].files]
    return write_recording(CONVERTERS[name](*files), folder)


def find_raw_file(recording: PublicRecording, file: RemoteFile) -> Path:
    """Path of one raw file whose content is as registered; from the local copies, else downloaded."""
    folder = local_copies()
    if folder is None:
        return _download(recording, file)
    path = folder / recording.folder / file.name
    try:
        found = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"cannot read {path} ({LOCAL_COPIES_VARIABLE}): {error.strerror}") from None
    if found != file.sha256:
        raise InputError(f"{path} is not the registered file: its SHA-256 is {found}, not {file.sha256}")
    return path


def is_available(recording: PublicRecording) -> bool:
    """True if all raw files are on this machine: in the folder that ARMLAB_RECORDINGS names, else in the cache."""
    folder = local_copies() or cache_folder()
    return folder is not None and all((folder / recording.folder / file.name).is_file() for file in recording.files)


def cache_folder() -> Path | None:
    """Where downloads are kept; None without pooch."""
    try:
        import pooch
    except ImportError:
        return None
    return Path(pooch.os_cache("armlab"))


def _download(recording: PublicRecording, file: RemoteFile) -> Path:
    cache = cache_folder()
    if cache is None:
        raise InputError("to download recordings install pooch: pip install 'armlab[recordings]'")
    import pooch

    try:
        folder = cache / recording.folder
        return Path(pooch.retrieve(file.address, f"sha256:{file.sha256}", file.name, folder))
    except (OSError, ValueError) as error:  # no connection; another content than registered
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"cannot fetch {file.address}: {reason}; or set {LOCAL_COPIES_VARIABLE} to a local copy"
        ) from None
