"""Fetches the raw files of a public recording, checks them, and writes them as a recording folder."""

import hashlib
import os
from pathlib import Path

from problem.errors import InputError
from problem.settings import nearest
from recordings.public.convert import CONVERTERS
from recordings.public.registry import PUBLIC, PublicRecording, RemoteFile
from recordings.write import write_recording

LOCAL_COPIES = "ARMLAB_RECORDINGS"


def fetch_recording(name: str, folder: Path) -> Path:
    """Writes a public recording into a new folder and returns its path.

    The raw files come from the folder that the environment variable ARMLAB_RECORDINGS names, else from their
    public address into the user's cache; a file with another SHA-256 is refused. Raises InputError for an
    unknown name, a file that cannot be had, and a folder that is not empty.
    """
    if name not in PUBLIC:
        raise InputError(f"unknown recording '{name}': {nearest(name, list(PUBLIC))}")
    files = [raw_file(PUBLIC[name], file) for file in PUBLIC[name].files]
    return write_recording(CONVERTERS[name](*files), folder)


def raw_file(recording: PublicRecording, file: RemoteFile) -> Path:
    """Path of one raw file whose content is as registered; from the local copies, else downloaded."""
    local = os.environ.get(LOCAL_COPIES)
    if not local:
        return _downloaded(recording, file)
    path = Path(local) / recording.folder / file.name
    try:
        found = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise InputError(f"cannot read {path} ({LOCAL_COPIES}): {error.strerror}") from None
    if found != file.sha256:
        raise InputError(f"{path} is not the registered file: its SHA-256 is {found}, not {file.sha256}")
    return path


def at_hand(recording: PublicRecording) -> bool:
    """True if all raw files are on this machine: in the folder that ARMLAB_RECORDINGS names, else in the cache."""
    local = os.environ.get(LOCAL_COPIES)
    folder = Path(local) if local else cache_folder()
    return folder is not None and all((folder / recording.folder / file.name).is_file() for file in recording.files)


def cache_folder() -> Path | None:
    """Where downloads are kept; None without pooch."""
    try:
        import pooch
    except ImportError:
        return None
    return Path(pooch.os_cache("armlab"))


def _downloaded(recording: PublicRecording, file: RemoteFile) -> Path:
    cache = cache_folder()
    if cache is None:
        raise InputError("to download recordings install pooch: pip install 'armlab[recordings]'")
    import pooch

    try:
        folder = cache / recording.folder
        return Path(pooch.retrieve(file.address, f"sha256:{file.sha256}", file.name, folder))
    except (OSError, ValueError) as error:  # no connection; another content than registered
        reason = " ".join(str(error).split())[:200]
        raise InputError(f"cannot fetch {file.address}: {reason}; or set {LOCAL_COPIES} to a local copy") from None
