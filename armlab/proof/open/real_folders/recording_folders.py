"""Recording folders below one folder: single ones, and pairs of an old and a new recording."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from armlab.common.errors import InputError
from armlab.common.settings import suggest_name
from armlab.proof.open.real_folders.facts import FactsFile
from armlab.recordings.recording_file import FILE_NAME

OLD, NEW = "old", "new"  # folders of a pair
PIECE_BYTES = 1 << 20


@dataclass(frozen=True)
class RecordingFolder:
    """name: its path below the folder of all recordings. pair: holds `old/` and `new/`, which are compared."""

    name: str
    path: Path
    pair: bool

    @property
    def verdict_name(self) -> str:
        """Name of the file that the diagnosis or the comparison writes."""
        return "comparison.json" if self.pair else "verdict.json"

    @property
    def files(self) -> tuple[Path, ...]:
        """All files in it, in a fixed order."""
        return tuple(sorted(path for path in self.path.rglob("*") if path.is_file()))

    @property
    def size(self) -> int:
        """Bytes of its files."""
        return sum(path.stat().st_size for path in self.files)

    def digest(self) -> str:
        """SHA-256 of the names and the content of its files."""
        out = hashlib.sha256()
        for path in self.files:
            out.update(f"{path.relative_to(self.path).as_posix()} {path.stat().st_size}\n".encode())
            with path.open("rb") as file:
                while piece := file.read(PIECE_BYTES):
                    out.update(piece)
        return out.hexdigest()

    def arguments(self) -> list[str]:
        """Arguments of the command line that diagnoses or compares it."""
        path = self.path.resolve()
        return ["diagnose", "--compare", str(path / OLD), str(path / NEW)] if self.pair else ["diagnose", str(path)]


def find_folders(root: Path) -> tuple[RecordingFolder, ...]:
    """All recordings and pairs below a folder, by name; InputError where it is none or holds none."""
    if not root.is_dir():
        raise InputError(f"no folder {root}: it should hold recording folders")
    found = tuple(sorted(_walk(root, root), key=lambda each: each.name))
    if not found:
        raise InputError(f"{root} holds no folder with {FILE_NAME}, nor one with {OLD}/ and {NEW}/")
    return found


def _walk(folder: Path, root: Path) -> Iterator[RecordingFolder]:
    for path in sorted(each for each in folder.iterdir() if each.is_dir() and not each.name.startswith(".")):
        name = path.relative_to(root).as_posix()
        if (path / FILE_NAME).is_file():
            yield RecordingFolder(name, path, pair=False)
        elif all((path / part / FILE_NAME).is_file() for part in (OLD, NEW)):
            yield RecordingFolder(name, path, pair=True)
        else:
            yield from _walk(path, root)


def choose_folders(folders: Sequence[RecordingFolder], only: Sequence[str]) -> tuple[RecordingFolder, ...]:
    """The folders of these names, all if none is named; InputError for an unknown name."""
    known = [each.name for each in folders]
    for name in only:
        if name not in known:
            raise InputError(f"unknown recording '{name}': {suggest_name(name, known)}")
    return tuple(each for each in folders if not only or each.name in only)


def check_facts(facts: FactsFile, path: Path, folders: Sequence[RecordingFolder]) -> None:
    """Raises InputError for facts (of the file `path`) about a folder that is not there, or of the other kind."""
    known = {each.name: each for each in folders}
    for kind, names in (("singles", facts.singles), ("pairs", facts.pairs)):
        for name in names:
            if name not in known:
                raise InputError(
                    f"{path} names a recording that is not there, '{name}': {suggest_name(name, list(known))}"
                )
            right = "pairs" if known[name].pair else "singles"
            if kind != right:
                raise InputError(f"'{name}' stands under {kind} in {path}, and should stand under {right}")
