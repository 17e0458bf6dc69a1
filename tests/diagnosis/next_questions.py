"""Verdicts, robots and questions for tests of the next experiment."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from armlab.common.arrays import Array
from armlab.diagnosis.next.problem import RivalSettings, TellApartProblem, TellApartSettings
from problem.robot_file import BUILT_IN_FOLDER

VISCOUS: dict[str, Any] = {"effect": "viscous_friction", "joint": 2, "parameters": {"coefficient": 0.3}}
LATE = {"effect": "time_delay", "joint": None}


def verdict_file(folder: Path, *findings: dict[str, Any], joints: int = 3) -> Path:
    """A verdict/1 with findings of an effect, a joint, parameters and rivals."""
    whole = [
        {
            "effect": each["effect"],
            "joint": each["joint"],
            "joints": [each["joint"]] if each["joint"] else [],
            "parameters": {n: {"value": v, "ci95": None, "unit": ""} for n, v in each["parameters"].items()},
            "equation": "",
            "heldout_rms_before": 1.0,
            "heldout_rms_after": 0.05,
            "rivals": each.get("rivals", []),
        }
        for each in findings
    ]
    errors = {"heldout_rms_before": 1.0, "heldout_rms_after": 0.05, "noise_floor": 0.05, "gap_closed": 1.0}
    fit = [{"joint": joint + 1, **errors} for joint in range(joints)]
    head = {"schema": "verdict/1", "status": "mismatch", "summary": "made for a test", "located": [], "unexplained": []}
    path = folder / "verdict.json"
    path.write_text(json.dumps({**head, "findings": whole, "fit": fit}))
    return path


def robot_file(folder: Path, **limits: float) -> Path:
    """The three-joint arm with limits of speed and acceleration."""
    data = yaml.safe_load((BUILT_IN_FOLDER / "irb120-arm.yaml").read_text())
    for joint in data["joints"]:
        joint.update({"velocity_limit": 2.0, "acceleration_limit": 10.0, **limits})
    path = folder / "robot.yaml"
    path.write_text(yaml.safe_dump(data))
    return path


def told_apart(*rivals: RivalSettings, **settings: Any) -> TellApartProblem:
    """The problem of the preset, in its own coordinates, on a short coarse motion."""
    quick = {"duration": 4.0, "harmonics": 4, "cutoff_hz": 10.0}
    given = {"rivals": rivals} if rivals else {}
    problem = TellApartSettings(**{**quick, **given, **settings}).build()
    assert isinstance(problem, TellApartProblem)
    return problem


def points(problem: TellApartProblem, count: int, seed: int = 0) -> Array:
    """Random points of a problem's box, (count, dimension)."""
    return np.random.default_rng(seed).uniform(problem.lower, problem.upper, (count, len(problem.lower)))
