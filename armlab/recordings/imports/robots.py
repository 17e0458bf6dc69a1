"""The robot of an import: a built-in one by its name, or a robot file, of which the recording gets a copy."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from armlab.common.errors import InputError
from armlab.recordings.imports.questions import Options
from armlab.recordings.recording_file import FILE_NAME
from problem.arm import Arm
from problem.impossible_bodies import find_impossible_bodies, repaired_text
from problem.locked_joints import LockedRobot, lock_joints, parse_locks, robot_text
from problem.robot_file import built_in_arms, load_arm


@dataclass(frozen=True, eq=False)
class ImportedRobot:
    """The arm of a recording. source: a built-in name or a robot file. locked: its joints that are locked, in words.

    repair: whether links that no body can be become the nearest bodies in the copy. impossible: those links, in words.
    """

    arm: Arm
    source: str
    tip: str | None
    locks: Mapping[str, float]
    locked: str
    repair: bool = False
    impossible: tuple[str, ...] = ()

    @property
    def name(self) -> str:
        """As the recording names it: a built-in name, or that of the copy beside `recording.yaml`."""
        name = Path(self.source).name
        return f"robot{Path(name).suffix}" if name == FILE_NAME else name

    @property
    def whole_name(self) -> str:
        """Of the file of the whole robot beside a copy with locked joints."""
        return f"whole-{self.name}"

    def copies(self, folder: Path) -> dict[str, str | bytes]:
        """Content of the robot file for a folder, by its name; none of a built-in robot.

        Where joints are locked, the file of the whole robot stands beside it, for what is made of a diagnosis.
        """
        path = Path(self.source)
        if self.source in built_in_arms():
            return {}
        if path.suffix not in (".urdf", ".xml"):
            return {self.name: self._repaired(path.read_text(encoding="utf-8")) if self.repair else path.read_bytes()}
        locked = lock_joints(path, self.tip, self.locks, folder)
        if not locked.positions or not locked.original.is_file():
            return {self.name: self._repaired(locked.text(str(locked.original.resolve())))}
        own = self._repaired(locked.text(self.whole_name))
        return {self.name: own, self.whole_name: robot_text(locked.original, folder)}

    def _repaired(self, text: str) -> str:
        return repaired_text(text, Path(self.source)) if self.repair else text


def read_robot(options: Options) -> ImportedRobot | None:
    """The robot that the options robot, tip and lock name; None where none is named.

    Raises InputError, and UndecidedError for the option tip where a file has several branches of moving joints.
    """
    source, tip, locks = options.get("robot"), options.get("tip"), parse_locks(options.get("lock") or ())
    repair = bool(options.get("repair"))
    if source is None:
        if tip or locks or repair:
            raise InputError("--tip, --lock and --repair belong to a robot file: give it with --robot")
        return None
    if not tip and not locks:
        arm, path = load_arm(source), Path(source)
        is_text = source not in built_in_arms() and path.suffix != ".xml"
        words = _impossible(path.read_text(encoding="utf-8"), path, repair) if is_text else ()
        return ImportedRobot(arm, source, None, {}, "", repair, words)
    if source in built_in_arms():
        raise InputError(f"--tip and --lock need a URDF or MJCF file; {source} is built in, as one chain of joints")
    robot: LockedRobot = lock_joints(Path(source), tip, locks, Path(source).parent)
    words = _impossible(robot.document, Path(source), repair)
    return ImportedRobot(robot.arm, source, tip, locks, robot.words, repair, words)


def _impossible(text: str, path: Path, repair: bool) -> tuple[str, ...]:
    """The links that no body can be, in words."""
    done = "which is written" if repair else "which --repair writes"
    return tuple(f"{body.words}, {done}" for body in find_impossible_bodies(text, path))
