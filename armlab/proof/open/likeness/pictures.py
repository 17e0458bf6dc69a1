"""Pictures of real and simulated recordings in one style and in random order, for a reader to sort.

A picture shows position, velocity and torque of one joint over ten seconds, without numbers, names or units on its
vertical axes. The key stands in a file of its own.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path

import numpy as np
from scipy.signal import butter, sosfiltfilt

from armlab.common.arrays import Array
from armlab.common.errors import DataError
from armlab.proof.open.likeness.features import read_runs
from armlab.recordings.recording import Run

SECONDS, LEAST_SECONDS = 10.0, 9.0
VELOCITY_HZ = 10.0  # low-pass of the positions that a drawn velocity is the derivative of
KEY_FILE, FOLDER = "pictures-key.json", "pictures"
MIN_MOVING = 0.02  # of the peak speed of the joint in the run, RMS in the window: something moves


@dataclass(frozen=True)
class Pictured:
    """A recording that may be drawn: its folder, and what the key says of it."""

    folder: Path
    about: str
    real: bool


def draw_pictures(found: Sequence[Pictured], number: int, seed: int) -> dict[str, bytes]:
    """Pictures of `number` recordings of each side, and the key, by file name.

    found: recordings in the order in which they are taken; one without a run of nine seconds is passed over.
    Raises DataError where a side has too few.
    """
    rng = np.random.default_rng(seed)
    drawn: list[tuple[Pictured, bytes]] = []
    for real in (True, False):
        own: list[tuple[Pictured, bytes]] = []
        for each in (each for each in found if each.real == real):
            window = _window(each.folder, rng) if len(own) < number else None
            if window is not None:
                own.append((each, _draw(*window)))
        if len(own) < number:
            raise DataError(f"{len(own)} of {number} {'real' if real else 'simulated'} recordings can be drawn")
        drawn += own
    order = rng.permutation(len(drawn))
    names = [f"picture-{place:02d}.png" for place in range(1, len(drawn) + 1)]
    key = {
        name: {"real": drawn[at][0].real, "recording": drawn[at][0].about}
        for name, at in zip(names, order, strict=True)
    }
    pictures = {f"{FOLDER}/{name}": drawn[at][1] for name, at in zip(names, order, strict=True)}
    return pictures | {KEY_FILE: (json.dumps(key, indent=1) + "\n").encode()}


def _window(folder: Path, rng: np.random.Generator) -> tuple[Array, Array, Array, Array] | None:
    """Time, position, velocity and torque of a joint that moves; None for a recording without such a stretch."""
    _, _, runs = read_runs(folder)
    long = [run for run in runs if run.time[-1] - run.time[0] >= LEAST_SECONDS]
    for at in rng.permutation(len(long)):
        run = long[at]
        start = run.time[0] + rng.uniform(0, max(run.time[-1] - run.time[0] - SECONDS, 0))
        inside = (run.time >= start) & (run.time <= start + SECONDS)
        velocity = _velocity(run)
        for joint in rng.permutation(run.joints):
            own, torque = velocity[:, joint], run.torque[inside, joint]
            moves = np.sqrt(np.mean(own[inside] ** 2)) > MIN_MOVING * np.abs(own).max() > 0
            if moves and np.ptp(torque) > 0:
                return run.time[inside] - start, run.position[inside, joint], own[inside], torque
    return None


def _velocity(run: Run) -> Array:
    """Of the low-passed position, the same for every picture, (samples, joints)."""
    step = (run.time[-1] - run.time[0]) / (run.samples - 1)
    sections = butter(2, min(2 * VELOCITY_HZ * step, 0.8), output="sos")
    return np.asarray(np.gradient(sosfiltfilt(sections, run.position, axis=0), step, axis=0))


def _draw(time: Array, *signals: Array) -> bytes:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 4.8), layout="constrained")
    for panel, signal, name in zip(
        figure.subplots(3, 1, sharex=True), signals, ("position", "velocity", "torque"), strict=True
    ):
        panel.plot(time, signal, color="black", linewidth=0.7)
        panel.set_yticks([])
        panel.set_ylabel(name)
        panel.set_xlim(0, SECONDS)
    panel.set_xlabel("time, s")
    out = BytesIO()
    figure.savefig(out, dpi=110, format="png", metadata={"Software": None})
    return out.getvalue()
