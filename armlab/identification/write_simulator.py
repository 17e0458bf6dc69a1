"""`armlab export-model`: a model in the user's own URDF or MJCF, or as a chain of its own."""

from pathlib import Path

from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from armlab.common.files import refuse_existing, write_texts
from armlab.identification.export import (
    SimulatorModel,
    build_simulator_model,
    mjcf_document,
    srdf_document,
    urdf_document,
)
from armlab.identification.model_file import read_model
from armlab.identification.patch import Patched, UnreadableError, patched_mjcf, patched_urdf
from problem.joint_words import joint_in_words

FORMATS = (".urdf", ".xml")


def export_model(path: Path, out: Path) -> ResultLines:
    """Writes the file and says what it does not hold.

    A model of a URDF becomes that URDF with other numbers, or an MJCF as MuJoCo reads the URDF; a model of an MJCF
    becomes that MJCF; any other one becomes a chain of bodies without meshes. Raises InputError where the ending or
    the model does not fit.
    """
    if out.suffix not in FORMATS:
        raise InputError(f"{out}: the file should end in .urdf or .xml (MJCF)")
    model = read_model(path)
    simulated, source = build_simulator_model(model), Path(model.robot)
    patched = _document(simulated, source, out)
    texts = {out.name: patched.text}
    missing, notes = list(simulated.missing), list(patched.notes)
    if out.suffix == ".urdf":
        missing = [
            f"spring of {joint_in_words(model.arm, number)}"
            for number, each in enumerate(simulated.field("stiffness"), 1)
            if each
        ]
        missing += simulated.missing
        if simulated.field("armature").any():
            texts[out.with_suffix(".srdf").name] = srdf_document(simulated)
            notes.append(
                "rotor inertias stand in the .srdf, which Pinocchio reads: URDF has no place for them, MJCF has"
            )
    refuse_existing(out.parent / name for name in texts)
    written = write_texts(texts, out.parent)
    yield from map(str, written)
    yield from notes
    if missing:
        yield "not in the file: " + "; ".join(missing)
    if simulated.thickened_links:
        yield f"given a little extent, as simulators want it: link {', '.join(map(str, simulated.thickened_links))}"
    return {"files": written, "not_in_the_file": missing, "thickened_links": simulated.thickened_links, "notes": notes}


def _document(simulated: SimulatorModel, source: Path, out: Path) -> Patched:
    if source.suffix not in FORMATS:
        return Patched(_chain(simulated, out), ())
    if source.suffix == ".xml" and out.suffix == ".urdf":
        keeps = f"a chain of bodies without meshes: only an .xml file keeps what {source.name} has"
        return Patched(_chain(simulated, out), (keeps,))
    try:
        made = patched_urdf(simulated, source, out.parent) if out.suffix == ".urdf" else patched_mjcf(simulated, source)
    except UnreadableError as error:
        return Patched(_chain(simulated, out), (f"a chain of bodies without meshes: {error}",))
    return Patched(made.text, (f"{source.name} with other numbers: its names, frames and meshes stay", *made.notes))


def _chain(simulated: SimulatorModel, out: Path) -> str:
    return urdf_document(simulated) if out.suffix == ".urdf" else mjcf_document(simulated)
