"""Public recordings of position servos without torque: an SO-101 arm, and an XL330 servo with a pendulum.

The files were converted (lists in cells to columns), so they cannot be downloaded; docs/recordings.md says how to
convert them. They are looked for below the folder that ARMLAB_RECORDINGS names, and in the cache.
"""

from pathlib import Path

import numpy as np
import pandas as pd

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.recordings.public import PublicRecording, RemoteFile, find_raw_file
from armlab.recordings.recording import Role
from armlab.recordings.recording_file import Draft, DraftRun, Keys, write_recording

CHECKSUMS = {
    "so101/model/so101_new_calib.xml": "49452de77885ab36014787349384ca5280e5e988e744cbd080d71e9c4917597a",
    "so101/backlash_detection.csv": "7a408cfdfc85e430527837b66d04809a0e59f73e20344877402d194f9a2ff2e7",
    "so101/chirp_sweep.csv": "75403829fda589473d4c6f7ef3673c54284ee60b90d33458fe360e377615855c",
    "so101/coupled_joints.csv": "76c80a575d1f893fb709ec833b22840f8c470fad9bd49252a5ecaab3ab0a5f08",
    "so101/friction_gravity.csv": "6d2cbb58734e95cf820690219cb5f44b561e9cd4fcd187fff4218b9e158751bf",
    "so101/hold_under_gravity.csv": "5ad195f8567900c347879cf603f3cf908df83c58b1e1acc91513428caf9dfb44",
    "so101/inertia_coupling.csv": "0f644ac656a1f7a1f752b6f5d1cfc5309d1d039d02ce9a2e09a2f30f8f556937",
    "so101/large_amplitude.csv": "4c9a347b0906164ac65c7882611a2c5e9af31214c1af2aee64414e7672288a2b",
    "so101/multisine.csv": "b31d29d903af4f0db2e81601a72dd4c1755fe323088298d235187319768c8704",
    "so101/pick_place.csv": "31d4b1b7a4fc6b5ace1714478b31d6132a1e30a1bb4fbce95aa69842be76db6c",
    "so101/prbs_excitation.csv": "5b1af2e2fea3613af3816a7ecbfc39f8ab562a196fa505a39ee46fa018a74f65",
    "so101/random_waypoints.csv": "f06ec8f564eba760130fb4dc389f2dd5bc0d767008d75b01d39023b621410417",
    "so101/single_joint_elbow.csv": "3efdb1d6504f25b4ec0c83b1cf4639cc11be379c55e842438cc5dc967db7f03e",
    "so101/single_joint_rotation.csv": "66783ed23ed28add8acf7864e8af6b8162b7f004e2d311dbc94a2efc6b31d45e",
    "so101/single_joint_wrist_pitch.csv": "967ed48703069061f81c7901ea8a2e08e22377f1160bfdb92316917800c05dfe",
    "so101/single_joint_wrist_roll.csv": "2c83995fc3849039c58a571a52fe9631809fb75530b5895472f988690954d9c8",
    "so101/slow_precision.csv": "80cd35cc514d87eaf060c421806bdbdff43ef5d6111245c3a3f7c7e69962927f",
    "so101/static_holding.csv": "9cbea90f5c280622957b8564537ac2f4ec4ac5e7fcf06dafe1876eef4cf1787e",
    "so101/step_response.csv": "18cc35339654e389d41f7e170d25f437dcbeb8c0ed17a37ff1bfc241884281fe",
    "so101/trapezoidal_profile.csv": "ff3ea69a8a5fa312e033744aeb54db84654da80d64c2b8fe44c1340f0cba66ed",
    "so101/workspace_sweep.csv": "df4cbe8fa5999808c96e92c3413e90b75c175499f961a7c0552fb527bd250ea9",
    "bam-servos/xl330_kp100_lift_and_drop.csv": "fbdb88a7cd421cf7de92b1e8f17623fc1d3676649e2d52d0f59efaf0280d5dc1",
    "bam-servos/xl330_kp100_sin_sin.csv": "8f4f18ccdff60509c38e4facfdd0d483f51bfad0a6be67d85bfebf95b245d89e",
    "bam-servos/xl330_kp100_sin_time_square.csv": "f8a4bf5f17e96ae2e1f38cc228598bbc2e6d52ac94e9b09414a95ab1a879994c",
    "bam-servos/xl330_kp100_up_and_down.csv": "a8db85731d1aceccab3dcc3dc6fb2833df0cb83eb474485e484f8e6a31506c52",
    "bam-servos/xl330_kp200_lift_and_drop.csv": "ad2b2ac2a2ad7c4959673fd7f8ce398149fadbf8e920c9a34e8303280e93134a",
    "bam-servos/xl330_kp200_sin_sin.csv": "6483d5d37e5be255d2705933ea47f8499a4521ac5fa476119d3ea22b6bbaed44",
    "bam-servos/xl330_kp200_sin_time_square.csv": "f85fc900edc2834c15739e3b629a36b0c4ca839914fe81b6ad98af3298dd2fd1",
    "bam-servos/xl330_kp200_up_and_down.csv": "c074507a8ea8578ae2e7283d6e728fa56acc7eb0d1e5e0a7188afd3c37f41f9e",
    "bam-servos/xl330_kp400_lift_and_drop.csv": "f0b2c206aa68607280da5084c8ea13fa5fd3196f712764ae8eb1a3e11d9995bb",
    "bam-servos/xl330_kp400_sin_sin.csv": "ed72f5261b499821f516e1eac1217bf285fd2507a3f540a75f32d6cef74bc9b0",
    "bam-servos/xl330_kp400_sin_time_square.csv": "479f8662b2d9f8109dc37c38edbd64d7ee4fc6324f295021f7b56fbc69ddc715",
    "bam-servos/xl330_kp400_up_and_down.csv": "4867c651349d5d4932e65c2179e0d19eb4b288d7081c38d0b3288d9bde231666",
    "bam-servos/xl330_kp800_lift_and_drop.csv": "3efdfefc83c41ed0bc9605d16c8e069088411db233014ff861261ff722f76ef7",
    "bam-servos/xl330_kp800_sin_sin.csv": "5dde3b5bff4b6605ebb4830f4675597b41b059161c6144b14d951d0570b9428f",
    "bam-servos/xl330_kp800_sin_time_square.csv": "f451c63b761ada9db26eafa872c50ed548cf84daf6a3174563a7df4acbeae53b",
    "bam-servos/xl330_kp800_up_and_down.csv": "5963da9296b572476fc970343592490053358a4087fcb55e4938edcad15b9482",
}
SO101_SOURCE = "isaac-sim2real/sage @ 4ffd262, output/real/so101/custom; model: TheRobotStudio/SO-ARM100 @ fda892c"
BAM_SOURCE = "Rhoban/bam @ af22604, bam/data.bak/raw"
SO101_JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
SO101_HELD_OUT = ("pick_place", "random_waypoints", "large_amplitude")
# Contact, from positions that stand still while the command moves on: wrist against its stop, arm on the table.
SO101_CONTACT: dict[str, tuple[tuple[float, float], ...]] = {
    "single_joint_wrist_roll": ((43.1, 44.3), (51.9, 53.1), (60.3, 62.3), (69.1, 71.1)),
    "single_joint_elbow": ((24.9, 50.6),),
    "workspace_sweep": tuple((start, start + 1.2) for start in (21.7, 42.0, 62.2, 82.4, 102.6)),
    "large_amplitude": ((103.6, 109.1),),
}
XL330_GAINS = (100, 200, 400, 800)
XL330_MOTIONS = ("sin_sin", "lift_and_drop", "up_and_down", "sin_time_square")
XL330_HELD_OUT = "sin_time_square"
XL330_MASS, XL330_LENGTH = 0.49, 0.1  # kg, m, conditions.csv; the mass of the arm between servo and weight is unknown
XL330_SUPPLY = 7.4  # V, nominal, conditions.csv
PENDULUM = f"""<mujoco model="xl330-pendulum">
  <compiler angle="radian"/>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="pendulum">
      <joint name="servo" axis="0 1 0"/>
      <inertial pos="0 0 -{XL330_LENGTH}" mass="{XL330_MASS}" diaginertia="1e-5 1e-5 1e-5"/>
      <site name="weight" pos="0 0 -{XL330_LENGTH}"/>
    </body>
  </worldbody>
</mujoco>
"""
PUBLIC_MOTION_RECORDINGS = ("so101", *(f"xl330-kp-{gain}" for gain in XL330_GAINS))


def fetch_motion_recording(name: str, folder: Path) -> Path:
    """Writes a public recording of motion only, with its robot, into a new folder and returns its path.

    Raises InputError for an unknown name, a file that is not at hand, and a folder that is not empty.
    """
    if name not in PUBLIC_MOTION_RECORDINGS:
        raise InputError(f"unknown recording '{name}': {suggest_name(name, list(PUBLIC_MOTION_RECORDINGS))}")
    if name == "so101":
        draft, robot = _so101(), _file("so101", "model/so101_new_calib.xml", SO101_SOURCE).read_text(encoding="utf-8")
    else:
        draft, robot = _xl330(name), PENDULUM
    return write_recording(draft, folder, {draft.robot: robot})


def _file(folder: str, name: str, source: str) -> Path:
    remote = RemoteFile(name, None, CHECKSUMS[f"{folder}/{name}"])
    return find_raw_file(PublicRecording(folder, source, "Apache-2.0", ()), remote)


def _so101() -> Draft:
    """Joints 1 to 5 of the SO-101; the map of the jaw's column to its joint is unknown, so the jaw is held."""
    joints = range(1, len(SO101_JOINTS) + 1)
    columns: Keys = {"time": "t", "reference_position": tuple(f"cmd{j}" for j in joints)}
    columns["position"] = tuple(f"q{j}" for j in joints)
    columns["current"] = tuple(f"tau{j}" for j in joints)  # of the supply, without sign and of unknown scale
    units: Keys = {"time": "s", "reference_position": "rad", "position": "rad", "current": "A"}
    names = ("t", *columns["reference_position"], *columns["position"], *columns["current"])
    runs = []
    for key in CHECKSUMS:
        folder, _, file = key.partition("/")
        if folder == "so101" and file.endswith(".csv"):
            motion = file.removesuffix(".csv")
            values = pd.read_csv(_file(folder, file, SO101_SOURCE))[list(names)].to_numpy(np.float64)
            role: Role = "validate" if motion in SO101_HELD_OUT else "identify"
            runs.append(DraftRun(file, role, names, values, SO101_CONTACT.get(motion, ())))
    others = {"joints": list(SO101_JOINTS), "sample_rate_hz": 49.85}
    comment = (f"Public recording so101, from {SO101_SOURCE}, licence Apache-2.0 (both).",)
    return Draft("so101.xml", columns, units, tuple(runs), others, comment)


def _xl330(name: str) -> Draft:
    """XL330 with a pendulum; its voltage drives the motor, so that supply is recorded, too."""
    gain = int(name.rsplit("-", 1)[1])
    columns: Keys = {"time": "t", "reference_position": ("goal",), "position": ("q",), "voltage": ("supply",)}
    columns["temperature"] = ("temperature",)
    units: Keys = {"time": "s", "reference_position": "rad", "position": "rad", "voltage": "V", "temperature": "degC"}
    names = ("t", "goal", "q", "supply", "temperature", "torque_enable")
    runs = []
    for motion in XL330_MOTIONS:
        file = f"xl330_kp{gain}_{motion}.csv"
        table = pd.read_csv(_file("bam-servos", file, BAM_SOURCE))[list(names)]
        driven = table["torque_enable"].to_numpy() == 1
        last = len(driven) if driven.all() else int(np.argmin(driven))  # afterwards the pendulum swings freely
        role: Role = "validate" if motion == XL330_HELD_OUT else "identify"
        runs.append(DraftRun(f"{motion}.csv", role, names, table.to_numpy(np.float64)[:last]))
    comment = (f"Public recording {name}, from {BAM_SOURCE}, licence Apache-2.0; gain register P = {gain}.",)
    controller = {"type": "pd", "kp": [None], "kd": [None], "supply": XL330_SUPPLY}
    return Draft("pendulum.xml", columns, units, tuple(runs), {"controller": controller}, comment)
