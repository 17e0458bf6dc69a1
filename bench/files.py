"""The folder of results: it never mixes the results of two configurations."""

import re
import tempfile
from collections.abc import Mapping
from hashlib import sha256
from itertools import zip_longest
from pathlib import Path

from armlab.common.errors import InputError
from armlab.common.files import write_whole


def settings_path(folder: Path, name: str) -> Path:
    """The file with the full settings of the results of that name, beside them."""
    return folder / f"{name}.settings.yaml"


def write_with_settings(folder: Path, name: str, files: Mapping[str, str | bytes], settings: str) -> list[Path]:
    """Write result files by name, and the settings that made them; returns the paths.

    The settings are written last, and old ones are removed first, so that incomplete results are never taken for
    complete ones. Raises InputError if a file cannot be written.
    """
    last = settings_path(folder, name)
    last.unlink(missing_ok=True)
    contents = {folder / each: content for each, content in files.items()} | {last: settings}
    for path, content in contents.items():
        write_whole(path, content)
    return list(contents)


_DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{k}" for port in ("com", "lpt") for k in range(10))}
_MAX_NAME = 60  # characters: of the 255 of a file system, some are the names around it


def file_name(label: str) -> str:
    """A label as a part of a file's name on any system, another one for each label.

    A label that has only small letters, digits, dots and dashes, is short and begins with a letter or digit stays as it
    is. Any other gets a part of its hash, since systems that ignore the case of letters would take two for one, hide
    what begins with a dot, and keep the names of devices for themselves.
    """
    stays = re.fullmatch(r"[a-z0-9]([a-z0-9.-]*[a-z0-9])?", label) and len(label) <= _MAX_NAME
    if stays and label.partition(".")[0] not in _DEVICES:
        return label
    plain = re.sub(r"[^A-Za-z0-9-]+", "_", label).strip("_-")[:_MAX_NAME]
    return f"{plain or 'label'}_{sha256(label.encode()).hexdigest()[:6]}"


def check_folder(folder: Path, name: str, settings: str, overwrite: bool = False) -> None:
    """Check, before hours of work, that results of these settings may be written into a folder.

    Raises InputError if the folder cannot be written, or if it holds results of that name and other settings, which
    are kept unless `overwrite`.
    """
    there = settings_path(folder, name)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
        found = there.read_bytes().decode(errors="replace") if there.exists() else None
    except OSError as error:
        raise InputError(f"cannot write to the results folder {folder}: {error.strerror}") from None
    if overwrite:
        return
    way_out = "choose another folder with --results, or replace them with --overwrite"
    if found is None and (folder / f"{name}.csv").exists():
        raise InputError(f"{folder}/{name}.csv stands without {there.name}, which would say how it was made: {way_out}")
    if found not in (None, settings):
        difference = _describe_first_difference(str(found), settings)
        raise InputError(f"{folder} holds results of another configuration ({difference}): {way_out}")


def _describe_first_difference(found: str, settings: str) -> str:
    pairs = zip_longest(found.splitlines(), settings.splitlines(), fillvalue="nothing")
    old, new = next(((old, new) for old, new in pairs if old != new), ("other line ends", "ours"))
    return f"'{old.strip()}' there, '{new.strip()}' here"
