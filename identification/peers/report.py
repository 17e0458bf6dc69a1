"""Writes `peers.md`: this package and its peers on the same runs."""

from collections.abc import Iterator, Sequence
from pathlib import Path

from identification.peers.side_by_side import Row
from problem.errors import InputError

HEAD = """# The same recordings through other packages

Percent of ||tau - tau_hat|| / ||tau|| over all joints: fitted on the run that identifies, the same smoothed motion,
the same low-pass on torque and prediction. Seconds: processor time of one fit without start-up and imports; that of
armlab includes smoothing, differentiation and intervals, the others get the motion ready. mujoco.sysid stops after
60 iterations.

`armlab, friction`, figaroh and mujoco.sysid have viscous and Coulomb friction, rotor inertia and offset at every
joint (`armlab, friction` and figaroh without a prior, joints weighted by their errors; mujoco.sysid: bodies that can
exist); `armlab, chosen` is the structure that cross-validation chose.

| recording | run | package | percent | seconds |
|---|---|---|---|---|
"""


def write_peers(rows: Sequence[Row], folder: Path) -> Path:
    """Path of the page; InputError where it cannot be written."""
    path = folder / "peers.md"
    try:
        path.write_text(HEAD + "".join(_lines(rows)), encoding="utf-8")
    except OSError as error:
        raise InputError(f"cannot write {path}: {error.strerror}") from None
    return path


def _lines(rows: Sequence[Row]) -> Iterator[str]:
    for row in rows:
        if row.percent is None or row.seconds is None:
            yield f"| {row.recording} | | {row.package} | {row.remark.replace('|', '/')} | |\n"
        else:
            yield f"| {row.recording} | {row.run} | {row.package} | {row.percent:.2f} | {row.seconds:.2g} |\n"
