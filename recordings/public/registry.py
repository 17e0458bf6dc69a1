"""The public files: address, SHA-256, licence, and the folder of a local copy."""

from dataclasses import dataclass

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


PUBLIC = {
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
