"""The table of `docs/recordings.md`, what was tried with which version; writes it when it is run."""

from importlib.metadata import version
from pathlib import Path

import yaml

from armlab.common.markdown import markdown_table
from armlab.recordings.lerobot_dataset import VERSION

PAGE = Path(__file__).parents[2] / "docs/recordings.md"
BEGIN, END = "<!-- Written by tests/recordings/client_versions.py: do not edit. -->", "<!-- End of the clients. -->"
FIELDS = Path(__file__).parents[1] / "diagnosis/simulator_fields.yaml"


def installed(*packages: str) -> str:
    """The packages with the versions that are installed."""
    return ", ".join(f"{name} {version(name)}" for name in packages)


def client_rows() -> list[list[str]]:
    """Client, what goes in, what goes out, what it was tried with."""
    isaac_lab = yaml.safe_load(FIELDS.read_text())["isaaclab"]["source"].partition(" (")[0]
    return [
        [
            "ROS 2 bag (SQLite, MCAP)",
            "joint states, states of controllers, commands: `recording import`",
            "`signals.mcap` of `diagnose --mcap`",
            f"{installed('rosbags', 'mcap', 'mcap-ros2-support')}; packages",
        ],
        [
            "LeRobot dataset",
            "version 2.1 and 3.0: `recording import`",
            "version 3.0: `recording export`",
            f"files of dataset version {VERSION.removeprefix('v')}, {installed('pyarrow')}; lerobot itself needs torch",
        ],
        [
            "MuJoCo MJCF",
            "robot, its laws and position servos",
            "`simulation.xml` of `diagnose`, `model export`",
            f"{installed('mujoco')}; package",
        ],
        [
            "Isaac Lab actuators",
            "stiffness, damping, limit of effort: `recording import --controller FILE.py`",
            "`isaaclab_actuators.py` of `diagnose`",
            f"fields of the source of {isaac_lab}; Isaac Sim is not run",
        ],
    ]


def client_table() -> str:
    """The part of the page between its marks."""
    return markdown_table(["client", "in", "out", "tried with"], client_rows())


if __name__ == "__main__":
    text = PAGE.read_text(encoding="utf-8")
    start, end = text.index(BEGIN) + len(BEGIN), text.index(END)
    PAGE.write_text(f"{text[:start]}\n\n{client_table().strip()}\n\n{text[end:]}", encoding="utf-8")
