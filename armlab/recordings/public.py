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
from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import MissingPackageError
from armlab.common.settings import suggest_name
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording, Role
from armlab.recordings.recording_file import FILE_NAME, Draft, DraftRun, Keys, write_recording

GITHUB = "https://raw.githubusercontent.com"
KUKA = f"{GITHUB}/JonasWeigand/Robot_Identification/454c8e6d4f6f9a9ec0b2fcb10b4cb958ac702e55/data/recorded_trajectories"
EMPS = f"{GITHUB}/forgi86/sysid-neural-continuous/93afc131780fb1d5477472935a18ac8405683890/examples/EMPS/data"
STAUBLI = f"{GITHUB}/thanhndv212/figaroh-plus/53d6517a3dcbf383bff864b54132b9ce25f7f3e7/examples/staubli_TX40/data"
UNISA = f"{GITHUB}/unisa-acg/inverse-dynamics-solver/e67a57eceefa7db7959eba076b6afbce12fa2cd6"
FRICTION_DAMPER = "ARTS-Laboratory/Dataset-Friction-Damper-with-Backlash @ 0e09aa9, data/dataset-1"


@dataclass(frozen=True)
class RemoteFile:
    """One public file: the name of its local copy, where it is, and the SHA-256 of its content.

    address: None for a file that its source holds in another form, so that it cannot be downloaded.
    """

    name: str
    address: str | None
    sha256: str


@dataclass(frozen=True)
class PublicRecording:
    """The raw files of one recording; `folder` is that of local copies, below ARMLAB_RECORDINGS."""

    folder: str
    source: str
    licence: str
    files: tuple[RemoteFile, ...]


def _friction_damper(tension: str, identify_sha256: str, validate_sha256: str) -> PublicRecording:
    """The damper at one band tension: its source has JSON, these are converted files (see docs/recordings.md)."""
    files = (RemoteFile("run-1-hz.csv", None, identify_sha256), RemoteFile("run-0p5-hz.csv", None, validate_sha256))
    return PublicRecording(
        f"friction-damper/tension-{tension}",
        FRICTION_DAMPER,
        "CC-BY-SA-4.0 (share alike: so is what is made of it)",
        files,
    )


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
    "friction-damper-20-lb": _friction_damper(
        "20-lb",
        "b1910aa6762e335931fea5034a114375233b8a306f930ae84d4a73a54bbbed5d",
        "55b5aa5063b0d61be1d6943adc82c69d796d10c9af25c24fc904aba4a3607879",
    ),
    "friction-damper-25-lb": _friction_damper(
        "25-lb",
        "8f5e5c7e8773fafe851514e0996f7591d5f1faebee5a9587d88df2ced0266cff",
        "2fc3bcefbd979d1c820b090cdd51c626902bc0131a6e1c86526e58f1c6fb5025",
    ),
    "friction-damper-35-lb": _friction_damper(
        "35-lb",
        "ab71ce448777fc0e2cd0bffce2af5399ea1e2b89788878a0192d2f9632d92e34",
        "6e1cf264ebf058a2b2cd78e673adefdf3bd2898cc76210b029e62d6ce5afd4bf",
    ),
    "friction-damper-80-lb": _friction_damper(
        "80-lb",
        "791c68774f082d618125dbc69823982ba563b8b09ee025bb10edccdcab03bcd9",
        "efeeb5fd20df5ebe110edc06ecc951b7d974f53f93fddfc500e5d859964ec4b3",
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


def convert_friction_damper(name: str, identify: Path, validate: Path) -> Draft:
    """Friction damper: position and velocity of its rod, and the force that drives it; the bands' forces stay out."""
    columns: Keys = {"time": "t", "position": ("x",), "velocity": ("v",), "torque": ("F",)}
    units: Keys = {"time": "s", "position": "m", "velocity": "m/s", "torque": "N"}
    names = _column_names(columns)
    files: tuple[tuple[Path, Role], ...] = ((identify, "identify"), (validate, "validate"))
    runs = tuple(
        DraftRun(path.name, role, names, pd.read_csv(path)[list(names)].to_numpy(float)) for path, role in files
    )
    return Draft("friction-damper", columns, units, runs, {"sample_rate_hz": 512.0}, _source_comment(name))


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
    **{
        name: partial(convert_friction_damper, name)
        for name in PUBLIC_RECORDINGS
        if name.startswith("friction-damper-")
    },
}


LOCAL_COPIES_VARIABLE = "ARMLAB_RECORDINGS"


def local_copies() -> Path | None:
    """The folder that the environment variable ARMLAB_RECORDINGS names; None where it is unset or blank."""
    folder = os.environ.get(LOCAL_COPIES_VARIABLE, "").strip()
    return Path(folder) if folder else None


def local_recording(name: str) -> Path | None:
    """The recording folder of this name directly below the local copies; None where there is none."""
    folder = local_copies()
    if folder is None or Path(name).name != name or not (folder / name / FILE_NAME).is_file():
        return None
    return folder / name


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


def open_public_recording(name: str, folder: Path) -> Recording:
    """The public recording in `folder` / `name`, fetched into it if there is no such folder yet."""
    place = folder / name
    return load_recording(place if place.is_dir() else fetch_recording(name, place))


def find_raw_file(recording: PublicRecording, file: RemoteFile) -> Path:
    """Path of one raw file whose content is as registered; from the local copies, else downloaded.

    What cannot be downloaded is looked for in the local copies, then in the cache.
    """
    if file.address is None:
        return _check_content(_find_converted_file(recording, file), file)
    folder = local_copies()
    if folder is None:
        return _download(recording, file.address, file)
    return _check_content(folder / recording.folder / file.name, file)


def _find_converted_file(recording: PublicRecording, file: RemoteFile) -> Path:
    folders = [folder / recording.folder for folder in (local_copies(), cache_folder()) if folder is not None]
    found = [folder / file.name for folder in folders if (folder / file.name).is_file()]
    if found:
        return found[0]
    place = str(folders[0]) if folders else f"a folder {recording.folder} below one that {LOCAL_COPIES_VARIABLE} names"
    raise InputError(
        f"no {file.name} in {place}: it cannot be downloaded, convert it from {recording.source} (docs/recordings.md "
        "says how) and put it there"
    )


def _check_content(path: Path, file: RemoteFile) -> Path:
    try:
        found = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"cannot read {path} ({LOCAL_COPIES_VARIABLE}): {error.strerror}") from None
    if found != file.sha256:
        raise InputError(f"{path} is not the registered file: its SHA-256 is {found}, not {file.sha256}")
    return path


def is_available(recording: PublicRecording) -> bool:
    """True if all raw files are on this machine: in the folder that ARMLAB_RECORDINGS names, else in the cache."""
    folders = [folder for folder in (local_copies(), cache_folder()) if folder is not None]
    return bool(folders) and all(
        any(
            (folder / recording.folder / file.name).is_file()
            for folder in (folders if not file.address else folders[:1])
        )
        for file in recording.files
    )


def cache_folder() -> Path | None:
    """Where downloads are kept; None without pooch."""
    try:
        import pooch
    except ImportError:
        return None
    return Path(pooch.os_cache("armlab"))


def _download(recording: PublicRecording, address: str, file: RemoteFile) -> Path:
    cache = cache_folder()
    if cache is None:
        raise MissingPackageError("pooch", "a download of recordings")
    import pooch

    try:
        folder = cache / recording.folder
        return Path(pooch.retrieve(address, f"sha256:{file.sha256}", file.name, folder))
    except (OSError, ValueError) as error:  # no connection; another content than registered
        reason = in_one_line(error)[:200]
        raise InputError(f"cannot fetch {address}: {reason}; or set {LOCAL_COPIES_VARIABLE} to a local copy") from None
