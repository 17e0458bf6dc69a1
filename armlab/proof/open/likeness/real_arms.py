"""Real recordings for a likeness: ready folders below the local copies, and public recordings; and which arm each is.

Folders of one arm are one arm, so that an arm that is left out is left out whole.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from armlab.recordings.motion import is_motion_only
from armlab.recordings.public import open_public_recording
from armlab.recordings.recording_file import FILE_NAME

PUBLIC = ("emps", "staubli-tx40", "unisa-ur10", "unisa-panda", "kuka-kr300")
ARMS = ("3215", "dfki", "dyno", "friction-damper", "go2", "kinova-gen3", "lwr4", "panda")  # in names of folders
SHARE_ALIKE = ("friction-damper",)


@dataclass(frozen=True)
class RealFolder:
    """A folder with a recording, its arm, and whether a page may name it."""

    path: Path
    arm: str
    licensed: bool
    name: str


def real_folders(local: Path, work: Path) -> Iterator[RealFolder]:
    """Every recording folder below the local copies, then the public ones, fetched into a work folder.

    A folder without a licence file is one that no page may name.
    """
    for file in sorted(local.rglob(FILE_NAME)):
        top = local / file.relative_to(local).parts[0]
        licensed = any(path.name.startswith("LICENSE") for path in top.iterdir())
        yield RealFolder(file.parent, arm_of(top.name), licensed, file.parent.relative_to(local).as_posix())
    for name in PUBLIC:
        yield RealFolder(open_public_recording(name, work).folder, arm_of(name), True, name)


def drawable_folders(folders: Iterable[RealFolder]) -> list[RealFolder]:
    """Folders of which a picture may stand in a page, with torque: one of each arm first, then a second one of each.

    Without those of `SHARE_ALIKE`, whose pictures would have to carry their licence.
    """
    count: Counter[str] = Counter()
    out: list[tuple[int, RealFolder]] = []
    for each in folders:
        if each.licensed and each.arm not in SHARE_ALIKE and not is_motion_only(each.path):
            out.append((count[each.arm], each))
            count[each.arm] += 1
    return [each for _, each in sorted(out, key=lambda entry: entry[0])]


def arm_of(name: str) -> str:
    """The arm that a folder's name tells: all folders with one of `ARMS` in their name are of one arm."""
    return next((arm for arm in ARMS if arm in name), name)
