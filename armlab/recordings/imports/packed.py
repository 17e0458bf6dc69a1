"""Packed logs: .gz, .bz2, .xz, .zip of one file, .zst; unpacked into a folder that goes again."""

import bz2
import gzip
import lzma
import shutil
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import IO, Any

from armlab.common.errors import InputError, in_one_line
from armlab.common.packages import MissingPackageError

PACKED_SUFFIXES = (".gz", ".bz2", ".xz", ".zip", ".zst", ".zstd")


@contextmanager
def unpacked(path: Path) -> Iterator[Path]:
    """The path of the file inside; InputError for a file that cannot be unpacked."""
    with TemporaryDirectory() as folder:
        inside = Path(folder) / path.stem
        try:
            if path.suffix.lower() == ".zip":
                own = Path(_only_name(path)).suffix.lower()
                inside = inside.with_suffix(own if own not in ("", ".zip") else ".csv")
            with _open(path) as packed, inside.open("wb") as out:
                shutil.copyfileobj(packed, out)
        except _unpack_errors() as error:
            raise InputError(f"cannot unpack {path}: {in_one_line(error)[:200]}") from None
        try:
            yield inside
        except InputError as error:
            raise InputError(str(error).replace(str(inside), str(path))) from None


def _open(path: Path) -> IO[bytes] | Any:
    suffix = path.suffix.lower()
    if suffix == ".gz":
        return gzip.open(path)
    if suffix == ".bz2":
        return bz2.open(path)
    if suffix == ".xz":
        return lzma.open(path)
    if suffix == ".zip":
        return zipfile.ZipFile(path).open(_only_name(path))
    try:
        import zstandard
    except ImportError:
        raise MissingPackageError("zstandard", f"{path}: a .zst file") from None
    return zstandard.open(path, "rb")


def _unpack_errors() -> tuple[type[Exception], ...]:
    """What the unpackers raise for a damaged file."""
    known = (OSError, EOFError, ValueError, RuntimeError, zlib.error, lzma.LZMAError, zipfile.BadZipFile)
    try:
        import zstandard
    except ImportError:
        return known
    return (*known, zstandard.ZstdError)


def _only_name(path: Path) -> str:
    """The one file in an archive."""
    with zipfile.ZipFile(path) as archive:
        names = [name for name in archive.namelist() if not name.endswith("/")]
    if len(names) != 1:
        raise InputError(f"{path} holds {len(names)} files: unpack it, and import those that are logs of the arm")
    return names[0]
