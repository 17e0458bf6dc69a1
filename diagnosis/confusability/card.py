"""The confusability card of a planned motion: what it shows of each effect, and which names it leaves open.

Everything follows from the geometry of the columns on this very motion, filtered as a diagnosis filters them; no
torque is needed. Two views: against the nominal simulation nothing is free, after a refit the base parameters are.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.settings import Settings
from armlab.effects.contract import Candidate, Family, Scene
from armlab.effects.separability import Confusion, base_rows, candidate_rows, compute_confusion
from diagnosis.confusability.planned import Planned
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.regressor import rigid_body_torque
from recordings.filters import Butterworth, Filter
from recordings.run import Array

ALIKE = 0.95  # cosine from which this motion does not separate two effects
SURE = 5.0  # standard errors that make a difference certain after correction
NOISE_SHARE = 0.01  # of a joint's rms torque: its noise where none is given
LEAST_NOISE = 0.01  # N m (N)
VIEWS = ("nominal", "refit")


@dataclass(frozen=True)
class Rival:
    """Another effect that can do all that one can. cosine: 1 where no amount of data tells them apart.

    separation: smallest size of the first, as rms torque in units of noise, at which the two differ by SURE errors.
    """

    index: int
    cosine: float
    separation: float


@dataclass(frozen=True)
class Entry:
    """One effect at one place, by view: absorbed share, smallest size that shows, rivals, the most alike first.

    size: rms torque in units of the noise. joint: from 1, the link for parameters of a link, None for the robot.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    form: str
    absorbed: dict[str, float]
    shows_from: dict[str, float]
    rivals: dict[str, tuple[Rival, ...]]

    @property
    def label(self) -> str:
        """Effect, place and form in short."""
        where = "" if self.joint is None else f" {self.joint}" + (f"<{self.joints[1]}" if len(self.joints) > 1 else "")
        return f"{self.effect}{where}" + (f" ({self.form})" if self.form else "")


@dataclass(frozen=True, eq=False)
class Card:
    """noise: (joints,), N m (N), of the filtered torque. rows: independent rows a joint. cosines: by view, [a, b]
    from a to the span of b.
    """

    arm: Arm
    trajectory: str
    entries: tuple[Entry, ...]
    cosines: dict[str, Array]
    noise: Array
    rows: float


def confusability(
    arm: Arm,
    motions: Sequence[Planned],
    families: Sequence[Family],
    noise: Array | None = None,
    settings: Settings | None = None,
) -> Card:
    """The card of some motions taken together. noise: (joints,), N m (N); a share of the torque if left out.

    Raises ValueError where the families have no candidate on this motion.
    """
    chosen = settings or Settings()
    scenes = tuple(_scene(arm, each) for each in motions)
    filters = tuple(_filter(each, chosen) for each in motions)
    scatter = _noise(scenes) if noise is None else np.asarray(noise, dtype=float)
    found = candidates(arm, scenes, filters, families)
    if not found:
        raise ValueError("no effect has a column on this motion")
    free = {"nominal": None, "refit": base_rows(base_parameters(arm), scenes, filters)}
    views = {name: compute_confusion(found, scenes, filters, free[name], scatter) for name in VIEWS}
    seconds = sum(float(each.time[-1] - each.time[0]) for each in motions)
    rows = 2 * chosen.cutoff_hz * seconds
    entries = tuple(_entry(index, views, rows) for index in range(len(found)))
    cosines = {name: view.covered for name, view in views.items()}
    return Card(arm, ", ".join(each.name for each in motions), entries, cosines, scatter, rows)


def candidates(
    arm: Arm, scenes: Sequence[Scene], filters: Sequence[Filter], families: Sequence[Family]
) -> list[Candidate]:
    """One candidate a place, in the middle of its shapes; none whose columns vanish on this motion."""
    places = [shapes for family in families for shapes in family.candidates(arm, scenes)]
    middle = [shapes[len(shapes) // 2] for shapes in places if shapes]
    return [each for each in middle if _shown(candidate_rows(each, scenes, filters))]


def _shown(rows: Array) -> bool:
    return bool(np.isfinite(rows).all() and np.all(np.any(rows != 0, axis=0)))


def _scene(arm: Arm, planned: Planned) -> Scene:
    inertial = arm.parameters if arm.links is not None else np.zeros(10 * len(arm))
    torque = rigid_body_torque(arm, planned.motion, inertial)
    if arm.rotor_inertia:
        torque = torque + np.asarray(arm.rotor_inertia) * planned.motion.acceleration
    return Scene(planned.name, planned.time, planned.motion, arm, inertial, torque)


def _filter(planned: Planned, settings: Settings) -> Filter:
    cutoff = min(settings.cutoff_hz, 0.32 * planned.rate_hz)
    step = max(int(planned.rate_hz / (settings.rows_per_cutoff * cutoff)), 1)
    return Butterworth(planned.rate_hz, cutoff, len(planned.time), step)


def _noise(scenes: Sequence[Scene]) -> Array:
    rms = np.sqrt(np.mean(np.concatenate([each.torque for each in scenes]) ** 2, axis=0))
    return np.asarray(np.maximum(NOISE_SHARE * rms, LEAST_NOISE))


def _entry(index: int, views: dict[str, Confusion], rows: float) -> Entry:
    candidate = views[VIEWS[0]].candidates[index]
    absorbed, shows, rivals = {}, {}, {}
    for name, view in views.items():
        visible = float(view.visible[index])
        absorbed[name] = max(1 - visible**2, 0.0)
        shows[name] = size_to_show(visible, rows)
        alike = [other for other in view.rivals(index, ALIKE) if not _nested(candidate, view.candidates[other])]
        rivals[name] = tuple(_rival(view, index, other, rows) for other in alike)
    return Entry(candidate.effect, candidate.joint, candidate.joints, candidate.form, absorbed, shows, rivals)


def _rival(view: Confusion, index: int, other: int, rows: float) -> Rival:
    cosine = float(view.covered[index, other])
    apart = float(np.sqrt(max(1 - cosine**2, 0.0)))
    return Rival(other, cosine, size_to_show(float(view.visible[index]) * apart, rows))


def size_to_show(share: float, rows: float) -> float:
    """rms torque, in units of noise, at which a share of a signal's length makes SURE standard errors."""
    return float(SURE / (np.sqrt(rows) * share)) if share > 1e-6 else float("inf")


def _nested(one: Candidate, other: Candidate) -> bool:
    """Whether one law contains the other at the same place by construction: that is no confusion."""
    same = one.joints == other.joints
    return same and (one.effect == other.effect or one.effect in other.replaces or other.effect in one.replaces)
