"""Files that are whole or not at all: a crash leaves the old content or the new one, never a part of it."""

import os
import shutil
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from armlab.common.errors import InputError


def write_whole(path: Path, content: str | bytes | Iterable[bytes]) -> None:
    """Replace a file in one step.

    content: the whole, or pieces that are written as they come.
    Raises InputError if the file cannot be written.
    """
    data = content.encode() if isinstance(content, str) else content
    draft = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        with draft.open("wb") as file:
            file.writelines([data] if isinstance(data, bytes) else data)
        draft.replace(path)
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    finally:
        with suppress(FileNotFoundError, NotADirectoryError):  # no draft was made, or it is in its place
            draft.unlink()


def refuse_inputs(inputs: Iterable[Path], outputs: Iterable[Path], made: str) -> None:
    """Raises InputError where an output would replace an input. made: what the inputs are made into, like `the model`.

    A file that does not exist yet is no input.
    """
    known = [each for each in inputs if each.exists()]
    for place in outputs:
        if place.exists() and any(place.samefile(each) for each in known):
            raise InputError(f"{place} is a file that {made} is made from: choose another name")


def refuse_existing(outputs: Iterable[Path]) -> None:
    """Raises InputError where a file that would be written is there already."""
    for place in outputs:
        if place.exists():
            raise InputError(f"{place} is there already: choose another name")


def write_texts(texts: Mapping[str, str | bytes], folder: Path) -> tuple[Path, ...]:
    """Write all texts (or bytes) under their names into a folder, or none of them; returns their paths.

    Other files of the folder stay. Raises InputError if a file cannot be written.
    """
    folder = folder.absolute()
    with all_or_none(folder) as draft:
        for name, text in texts.items():
            (draft / name).parent.mkdir(parents=True, exist_ok=True)
            (draft / name).write_bytes(text.encode() if isinstance(text, str) else text)
    return tuple(folder / name for name in texts)


@contextmanager
def all_or_none(folder: Path) -> Iterator[Path]:
    """A draft folder whose files are moved into a folder at the end by renames, or none of them.

    Other files of the folder stay. Raises InputError if a file cannot be written.
    """
    folder = folder.absolute()
    exists = folder.is_dir()
    draft = (folder if exists else folder.parent) / f".armlab.{os.getpid()}"
    try:
        draft.mkdir(parents=True, exist_ok=True)
        yield draft
        if not exists:
            draft.replace(folder)
        else:
            _move_files(draft, folder)
    except OSError as error:
        raise InputError(f"cannot write into {folder}: {error.strerror}") from None
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def _move_files(draft: Path, folder: Path) -> None:
    files = [path for path in draft.rglob("*") if path.is_file()]
    places = [folder / path.relative_to(draft) for path in files]
    for place in places:
        place.parent.mkdir(parents=True, exist_ok=True)
        if place.is_dir():
            raise InputError(f"{place} is a folder, where a file should be written")
    for path, place in zip(files, places, strict=True):
        path.replace(place)
