"""`armlab export-model`: a model file as URDF or MJCF."""

from collections.abc import Iterator
from pathlib import Path

from identification.export.chain import joint_values, left_out
from identification.export.mjcf import mjcf
from identification.export.urdf import urdf
from identification.model import Model
from problem.errors import InputError

WRITERS = {".urdf": urdf, ".xml": mjcf}


def export_model(path: Path, out: Path) -> Iterator[str]:
    """Writes the file and tells what it does not hold; InputError where the ending or the model does not fit."""
    if out.suffix not in WRITERS:
        raise InputError(f"{out}: the file should end in .urdf or .xml (MJCF)")
    model = Model.load(path)
    text = WRITERS[out.suffix](model)
    try:
        out.write_text(text, encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {out}: {error.strerror}") from None
    yield str(out)
    missing = left_out(model)
    if out.suffix == ".urdf" and joint_values(model)["armature"].any():
        missing = ("rotor inertias (URDF has no place for them; MJCF has)", *missing)
    if missing:
        yield "not in the file: " + "; ".join(missing)
