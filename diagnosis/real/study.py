"""One public recording: what the diagnosis says of it, and the gain on the runs that took no part."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.result import Claim, Diagnosis
from identification.real.looks import Looks
from identification.real.recipes import RECIPES
from recordings.load import load_recording
from recordings.public.fetch import fetch_recording
from recordings.recording import Recording
from recordings.run import Array

MODEL = "diagnosis"
NAMES = ("emps", "staubli-tx40", "unisa-ur10", "kuka-kr300")
ALONE = ("kuka-kr300",)  # each of their runs is diagnosed alone too: one payload, so one answer
OF_LINKS = ("payload", "inertial_parameter_error")


@dataclass(frozen=True)
class RunGain:
    """Error of a run in percent of its torque, over all joints: as given (None without links), refitted, found.

    best_known: the figure of a published or hand-made model.
    """

    run: str
    given: float | None
    refitted: float
    found: float
    best_known: float | None


@dataclass(frozen=True, eq=False)
class RealStudy:
    """alone: the diagnosis of each run by itself, where that was asked for."""

    name: str
    diagnosis: Diagnosis
    gains: tuple[RunGain, ...]
    alone: tuple[tuple[str, Diagnosis], ...] = ()


def study(name: str, recordings: Path, looks: Looks, progress: Callable[[str], None]) -> RealStudy:
    """Diagnoses a recording that is fetched into `recordings` (taken from there if it is there already)."""
    place = recordings / name
    recording = load_recording(place if place.is_dir() else fetch_recording(name, place))
    for run in recording.with_role("validate"):
        looks.note(recording.arm.name, run.name, MODEL)
    found = diagnose(recording, progress=progress)
    alone = tuple(_alone(recording, index, progress) for index in range(len(recording.runs)) if name in ALONE)
    return RealStudy(name, found, gains(name, found), alone)


def _alone(recording: Recording, index: int, progress: Callable[[str], None]) -> tuple[str, Diagnosis]:
    run = recording.runs[index]
    return run.name, diagnose(replace(recording, runs=(replace(run, role="identify"),)), progress=progress)


def gains(name: str, found: Diagnosis) -> tuple[RunGain, ...]:
    """Of every run that validates; of the held-out blocks where none does."""
    if found.observed is None or found.final is None or found.refit is None or found.nominal is None:
        return ()
    known = next((each.best_known for each in RECIPES if each.name == name), {})
    torque, out = found.observed.torque, []
    for index, run in enumerate(found.observed.names):
        segments = [each for each in found.observed.of_role("validate") if each.run == index]
        if not segments:
            continue
        rows = np.concatenate([np.arange(each.start, each.stop) for each in segments])
        given = None if found.simulation.kind == "refit" else _percent(found.nominal[rows], torque[rows])
        refitted, final = (_percent(each[rows], torque[rows]) for each in (found.refit, found.final))
        out.append(RunGain(run, given, refitted, final, known.get(run)))
    return tuple(out)


def _percent(residual: Array, torque: Array) -> float:
    return float(100 * np.linalg.norm(residual) / np.linalg.norm(torque))


def added_mass(found: Diagnosis) -> tuple[Claim, ...]:
    """Claims that give a link more or less mass."""
    return tuple(each for each in found.claims if each.effect in OF_LINKS)
