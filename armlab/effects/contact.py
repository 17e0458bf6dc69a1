"""A push during a stretch of time, in one run."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.effects.contract import TORQUE, Candidate, Effect, Parameter, Scene, Value
from armlab.effects.term import Term, TermFamily, format_number
from problem.arm import Arm

EXTERNAL_CONTACT_FACTS = Effect(
    "external_contact",
    "a push during a stretch of time",
    (Parameter("start", "s"), Parameter("end", "s"), Parameter("peak", TORQUE)),
    sentence="Something pushes {place} during a stretch of time",
    figures="{peak} at most, from {start} to {end}",
    law=(
        r"\Delta\tau_j = \text{peak} \; \sin\left( \pi \, \frac{t - \text{start}}{\text{end} - \text{start}} "
        r"\right), \quad \text{start} < t < \text{end}"
    ),
    single_event=True,
    scanned=True,
    axis="time",
    experiment="repeat the run without contact",
)

GRID_DURATIONS_S = (0.3, 1.0, 3.0)  # s, of a plain grid
SCANNED_DURATIONS_S = tuple(0.1 * 2 ** (number / 2) for number in range(11))  # s
MIN_DURATION_S = 0.05  # s
MAX_DURATION_SHARE = 0.3  # of a run: what lasts longer is no push but another load
GRID_WINDOWS = 40  # of a plain grid, a run and joint


@dataclass(frozen=True)
class Contact(Term):
    """peak sin(pi (t - start) / (end - start)) between start and end of one run; shape: start, end, s."""

    facts = EXTERNAL_CONTACT_FACTS
    form = "half sine"
    names = ("start", "end", "peak")
    of_time = True
    of_one_run = True
    run: str = field(default="", kw_only=True)

    def columns(self, scene: Scene) -> Array:
        """The push; nothing in other runs."""
        return self._stacked(self.window(scene.time) if scene.run == self.run else np.zeros(len(scene.time)))

    def window(self, time: Array) -> Array:
        """The push at a peak of one."""
        start, end = self.shape
        inside = (time >= start) & (time <= end)
        return np.where(inside, np.sin(np.pi * (time - start) / max(end - start, MIN_DURATION_S)), 0.0)

    def with_shape(self, shape: tuple[float, ...]) -> "Contact":
        """The push at another time, of a shortest duration at least."""
        return super().with_shape((shape[0], max(shape[1], shape[0] + MIN_DURATION_S)))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """When, and how strong."""
        return {"start": self.shape[0], "end": self.shape[1], "peak": float(coefficients[0])}

    def equation(self, coefficients: Array) -> str:
        start, end = (format_number(value) for value in self.shape)
        return f"tau_{self.joint} += up to {format_number(coefficients[0])} from {start} s to {end} s of {self.run}"

    @classmethod
    def from_parameters(cls, arm: Arm, joints: tuple[int, ...], parameters: object) -> "tuple[Contact, Array]":
        """No: it belongs to one run of one recording."""
        raise ValueError("external_contact belongs to one run and is no part of a model")


@dataclass(frozen=True)
class Push(Contact):
    """peak between start and end of one run: a push with steep ends."""

    form = "box"

    def window(self, time: Array) -> Array:
        """One between start and end."""
        start, end = self.shape
        return np.where((time >= start) & (time <= end), 1.0, 0.0)


@dataclass(frozen=True)
class ContactFamily(TermFamily):
    """A place is a joint in a run."""

    facts: Effect = EXTERNAL_CONTACT_FACTS
    terms: tuple[type[Term], ...] = (Contact,)

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """Half sines of three durations that overlap by half, thinned to WINDOWS: use `scan` for all of them."""
        return [
            [
                _contact_between(Contact, arm, joint, scene, start, start + length)
                for start, length in _grid_windows(scene)
            ]
            for joint in range(1, len(arm) + 1)
            for scene in scenes
        ]

    def scan(self, arm: Arm, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[list[Candidate]]:
        """The strongest stretch of each joint and run, by the mean of what is left over windows of time."""
        found: list[list[Candidate]] = []
        for joint in range(1, len(arm) + 1):
            for scene, residual in zip(scenes, residuals, strict=True):
                start, end, looks = _strongest_window(scene, residual[:, joint - 1])
                half = 0.17 * (end - start)  # a half sine is wider than the window that fits it best
                forms = (Contact, start - half, end + half), (Push, start, end)
                found.append(
                    [replace(_contact_between(form, arm, joint, scene, *ends), looks=looks) for form, *ends in forms]
                )
        return found


def _contact_between(form: type[Contact], arm: Arm, joint: int, scene: Scene, start: float, end: float) -> Contact:
    last = float(scene.time[-1])
    return form.at(arm, joint, run=scene.run, shape=(max(start, 0.0), min(end, last)), bounds=((0.0, last),) * 2)


def _grid_windows(scene: Scene) -> list[tuple[float, float]]:
    """Starts and lengths of windows, s."""
    last = float(scene.time[-1])
    lengths = [length for length in GRID_DURATIONS_S if length <= MAX_DURATION_SHARE * last] or [
        MAX_DURATION_SHARE * last
    ]
    windows = [(start, x) for x in lengths for start in np.arange(0, last - x / 2, x / 2).tolist()]
    return windows[:: max(1, -(-len(windows) // GRID_WINDOWS))]


def _strongest_window(scene: Scene, left: Array) -> tuple[float, float, int]:
    """Start and end of the window with the largest sum over the root of its length, and how many there were."""
    known = np.isfinite(left)
    total = np.concatenate([[0.0], np.cumsum(np.where(known, left, 0.0) - np.mean(left[known]) * known)])
    best, found, looks = -1.0, (0.0, float(scene.time[-1])), 0
    for length in SCANNED_DURATIONS_S:
        width = max(round(length / scene.step), 1)
        if width > MAX_DURATION_SHARE * len(left):
            continue
        sums = np.abs(total[width:] - total[:-width]) / np.sqrt(width)
        place, looks = int(np.argmax(sums)), looks + 2 * len(left) // width
        if sums[place] > best:
            best, found = float(sums[place]), (float(scene.time[place]), float(scene.time[place + width - 1]))
    return *found, max(looks, 1)


EXTERNAL_CONTACT = ContactFamily()
