"""`armlab export-model`: a model of `identify` or `diagnose` as URDF (and SRDF) or MJCF."""

from collections.abc import Iterator
from pathlib import Path

from diagnosis.export.simulator import carried, in_urdf, mjcf_text
from identification.export.command import check_ending, write_files
from identification.model_file import read_model


def export_model(path: Path, out: Path) -> Iterator[str]:
    """Writes the file and tells what it does not hold; InputError where the ending or the model does not fit."""
    check_ending(out)
    found = carried(read_model(path))
    text, missing = (mjcf_text(found), found.missing) if out.suffix == ".xml" else in_urdf(found)
    yield from write_files(found.model, out, text, missing)
    if found.thin:
        yield f"given a little extent, as simulators want it: link {', '.join(map(str, found.thin))}"
