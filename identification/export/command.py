"""`armlab export-model`: a model file as URDF (and SRDF) or MJCF."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from identification.export.chain import joint_values, left_out
from identification.export.mjcf import mjcf
from identification.export.srdf import srdf
from identification.export.urdf import urdf
from identification.model import Model
from identification.torque_model import TorqueModel
from problem.errors import InputError

WRITERS = {".urdf": urdf, ".xml": mjcf}


def export_model(path: Path, out: Path) -> Iterator[str]:
    """Writes the file and tells what it does not hold; InputError where the ending or the model does not fit."""
    check_ending(out)
    model = Model.load(path)
    yield from write_files(model, out, WRITERS[out.suffix](model), left_out(model))


def check_ending(out: Path) -> None:
    """InputError for a file of another format."""
    if out.suffix not in WRITERS:
        raise InputError(f"{out}: the file should end in .urdf or .xml (MJCF)")


def write_files(model: TorqueModel, out: Path, text: str, missing: Sequence[str]) -> Iterator[str]:
    """Writes the text of a model, and rotor inertias beside a URDF. missing: what the file does not hold."""
    yield from _written(out, text)
    if out.suffix == ".urdf" and joint_values(model)["armature"].any():
        yield from _written(out.with_suffix(".srdf"), srdf(model))
        yield "rotor inertias stand in the .srdf, which Pinocchio reads: URDF has no place for them, MJCF has"
    if missing:
        yield "not in the file: " + "; ".join(missing)


def _written(path: Path, text: str) -> Iterator[str]:
    try:
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    yield str(path)
