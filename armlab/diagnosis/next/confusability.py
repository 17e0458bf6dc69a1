"""The confusability card of a planned motion, which is read from a CSV file, a recording or the best known results:
what the motion shows of each effect, and which effects it cannot separate.

Everything follows from the geometry of the columns on this motion, filtered as a diagnosis filters them; no
torque is needed. There are two views: against the nominal simulation nothing is free; after a refit the base
parameters are free.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.interpolate import make_interp_spline

from armlab.common.arrays import Array
from armlab.common.errors import DataError, InputError
from armlab.common.settings import suggest_name
from armlab.diagnosis.settings import Settings
from armlab.effects.contract import Candidate, Family, Scene
from armlab.effects.separability import Confusion, base_rows, candidate_rows, compute_confusion
from armlab.recordings.differentiate import differentiate
from armlab.recordings.filters import Butterworth
from armlab.recordings.load import load_recording
from armlab.recordings.repair import MAX_PLAUSIBLE_VALUE
from armlab.recordings.table import read_table
from problem.arm import Arm
from problem.base_parameters import base_parameters
from problem.drive_torque import drive_torque
from problem.excitation import ExcitationProblem
from problem.motion import Motion
from problem.registry import parse_problem
from problem.trajectories import sample_instants

MOTION_RATE_HZ = 250.0  # a sparser motion is filled in by splines
BEST_KNOWN_FILE = Path("results/best_known.json")


@dataclass(frozen=True, eq=False)
class PlannedMotion:
    """name: for the card. time: (samples,), s, even. motion: (samples, joints), SI."""

    name: str
    time: Array
    motion: Motion

    @property
    def rate_hz(self) -> float:
        """Samples per second."""
        return float((len(self.time) - 1) / (self.time[-1] - self.time[0]))


def read_planned_motions(trajectory: str, arm: Arm, records: Path = BEST_KNOWN_FILE) -> tuple[PlannedMotion, ...]:
    """The motions of a CSV file (t, q1 .., SI), of a recording folder, or of a record of best_known.json.

    Raises InputError, in one line, where there is none of that name or where it does not fit the arm.
    """
    path = Path(trajectory)
    if path.is_dir():
        found = _motions_of_recording(path)
    elif path.suffix.lower() == ".csv":
        found = (_motion_from_csv(path, len(arm)),)
    else:
        found = (_best_known_motion(trajectory, records),)
    for each in found:
        if each.motion.joints != len(arm):
            joints = f"{each.motion.joints} joints, {arm.name} has {len(arm)}"
            raise InputError(f"{each.name} moves {joints}")
    return found


def _motions_of_recording(folder: Path) -> tuple[PlannedMotion, ...]:
    signals = [differentiate(run) for run in load_recording(folder).runs]
    return tuple(PlannedMotion(each.run.name, each.run.time - each.run.time[0], each.motion) for each in signals)


MAX_PLANNED_SAMPLES = 2_000_000


def _motion_from_csv(path: Path, joints: int) -> PlannedMotion:
    """Positions of a file at even stamps; velocities and accelerations from their quintic spline."""
    table = read_table(path)
    names = ["t", *(f"q{number}" for number in range(1, joints + 1))]
    values = table.columns(names, "time and position, in s and rad or m")
    if len(values) < 10 or not np.isfinite(values).all() or np.any(np.diff(values[:, 0]) <= 0):
        raise InputError(f"{path}: should have ten rows or more of finite numbers, with t increasing")
    if np.abs(values).max() > MAX_PLAUSIBLE_VALUE:
        raise InputError(f"{path}: no arm moves as far as {np.abs(values).max():g}; t in s, q1 .. in rad or m")
    time, position = values[:, 0] - values[0, 0], values[:, 1:]
    rate = max(MOTION_RATE_HZ, 1 / float(np.median(np.diff(time))))
    if time[-1] * rate > MAX_PLANNED_SAMPLES:
        raise InputError(f"{path}: {time[-1]:g} s at {rate:g} Hz are more than {MAX_PLANNED_SAMPLES} samples")
    even = np.linspace(0.0, time[-1], round(time[-1] * rate) + 1)
    spline = make_interp_spline(time, position, k=5)
    return PlannedMotion(path.name, even, Motion(spline(even), spline(even, 1), spline(even, 2)))


def _best_known_motion(name: str, records: Path) -> PlannedMotion:
    known = json.loads(records.read_text(encoding="utf-8"))["problems"] if records.is_file() else {}
    if name not in known:
        hint = suggest_name(name, list(known))
        raise InputError(f"'{name}' is no CSV file, no recording folder, and no trajectory of {records}: {hint}")
    record = known[name]
    problem = parse_problem(record["settings"], f"{records}, {name}").build()
    if not isinstance(problem, ExcitationProblem):
        raise InputError(f"{records}, {name}: a trajectory in shifted coordinates cannot be taken")
    point = np.array([record["coefficients"][key] for key in problem.trajectory.names])
    time = sample_instants(problem.duration, round(problem.duration * MOTION_RATE_HZ) + 1)
    return PlannedMotion(name, time, problem.trajectory.motions(point[None], time).motion.select(np.intp(0)))


MIN_CONFUSED_COSINE = 0.95  # cosine from which this motion does not separate two effects
CERTAIN_STANDARD_ERRORS = 5.0  # standard errors that make a difference certain after correction
NOISE_SHARE = 0.01  # of a joint's rms torque: its noise where none is given
MIN_NOISE = 0.01  # N m (N)
VIEWS = ("nominal", "refit")


@dataclass(frozen=True)
class ConfusedEffect:
    """Another effect that can imitate an entry. cosine: 1 where no amount of data separates the two.

    separation: smallest size of the entry, as rms torque in units of noise, at which the two differ by
    CERTAIN_STANDARD_ERRORS.
    """

    index: int
    cosine: float
    separation: float


@dataclass(frozen=True)
class CardEntry:
    """One effect at one place, by view: absorbed share, smallest size that shows, rivals, the most alike first.

    size: rms torque in units of the noise. joint: from 1, the link for parameters of a link, None for the robot.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    form: str
    absorbed: dict[str, float]
    shows_from: dict[str, float]
    rivals: dict[str, tuple[ConfusedEffect, ...]]

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
    entries: tuple[CardEntry, ...]
    cosines: dict[str, Array]
    noise: Array
    rows: float


def confusability_card(
    arm: Arm, motions: Sequence[PlannedMotion], families: Sequence[Family], noise: Array | None = None
) -> Card:
    """The card of some motions taken together. noise: (joints,), N m (N); a share of the torque if left out.

    Raises ValueError where the families have no candidate on this motion.
    """
    settings = Settings()
    scenes = tuple(_planned_scene(arm, each) for each in motions)
    filters = tuple(_diagnosis_filter(each, settings) for each in motions)
    scatter = _default_noise(scenes) if noise is None else np.asarray(noise, dtype=float)
    candidates = visible_candidates(arm, scenes, filters, families)
    if not candidates:
        raise DataError("no effect has a column on this motion")
    free = {"nominal": None, "refit": base_rows(base_parameters(arm), scenes, filters)}
    views = {name: compute_confusion(candidates, scenes, filters, free[name], scatter) for name in VIEWS}
    seconds = sum(float(each.time[-1] - each.time[0]) for each in motions)
    rows = 2 * settings.tuning.data.cutoff_hz * seconds
    entries = tuple(_card_entry(index, views, rows) for index in range(len(candidates)))
    cosines = {name: view.covered for name, view in views.items()}
    return Card(arm, ", ".join(each.name for each in motions), entries, cosines, scatter, rows)


def visible_candidates(
    arm: Arm, scenes: Sequence[Scene], filters: Sequence[Butterworth], families: Sequence[Family]
) -> list[Candidate]:
    """One candidate a place, in the middle of its shapes; none whose columns vanish on this motion."""
    places = [shapes for family in families for shapes in family.candidates(arm, scenes)]
    middle = [shapes[len(shapes) // 2] for shapes in places if shapes]
    return [each for each in middle if _is_visible(candidate_rows(each, scenes, filters))]


def _is_visible(rows: Array) -> bool:
    return bool(np.isfinite(rows).all() and np.all(np.any(rows != 0, axis=0)))


def _planned_scene(arm: Arm, planned: PlannedMotion) -> Scene:
    inertial = arm.parameters if arm.links is not None else np.zeros(10 * len(arm))
    torque = drive_torque(arm, planned.motion, inertial)
    return Scene(planned.name, planned.time, planned.motion, arm, inertial, torque)


def _diagnosis_filter(planned: PlannedMotion, settings: Settings) -> Butterworth:
    tuning = settings.tuning.data
    cutoff = min(tuning.cutoff_hz, tuning.max_cutoff_ratio * planned.rate_hz)
    step = max(int(planned.rate_hz / (tuning.rows_per_cutoff * cutoff)), 1)
    return Butterworth(planned.rate_hz, cutoff, len(planned.time), step)


def _default_noise(scenes: Sequence[Scene]) -> Array:
    rms = np.sqrt(np.mean(np.concatenate([each.torque for each in scenes]) ** 2, axis=0))
    return np.asarray(np.maximum(NOISE_SHARE * rms, MIN_NOISE))


def _card_entry(index: int, views: dict[str, Confusion], rows: float) -> CardEntry:
    candidate = views[VIEWS[0]].candidates[index]
    absorbed, shows, rivals = {}, {}, {}
    for name, view in views.items():
        visible = float(view.visible[index])
        absorbed[name] = max(1 - visible**2, 0.0)
        shows[name] = size_to_show(visible, rows)
        alike = [
            other
            for other in view.rivals(index, MIN_CONFUSED_COSINE)
            if not _is_nested(candidate, view.candidates[other])
        ]
        rivals[name] = tuple(_confused_rival(view, index, other, rows) for other in alike)
    return CardEntry(candidate.effect, candidate.joint, candidate.joints, candidate.form, absorbed, shows, rivals)


def _confused_rival(view: Confusion, index: int, other: int, rows: float) -> ConfusedEffect:
    cosine = float(view.covered[index, other])
    apart = float(np.sqrt(max(1 - cosine**2, 0.0)))
    return ConfusedEffect(other, cosine, size_to_show(float(view.visible[index]) * apart, rows))


def size_to_show(share: float, rows: float) -> float:
    """rms torque, in units of noise, at which this share of a signal is CERTAIN_STANDARD_ERRORS long."""
    return float(CERTAIN_STANDARD_ERRORS / (np.sqrt(rows) * share)) if share > 1e-6 else float("inf")


def _is_nested(one: Candidate, other: Candidate) -> bool:
    """Whether one law contains the other at the same place by construction: that is no confusion."""
    same = one.joints == other.joints
    return same and (one.effect == other.effect or one.effect in other.replaces or other.effect in one.replaces)
