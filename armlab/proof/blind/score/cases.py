"""Judged cases: answers and verdicts side by side, and the category of each finding.

A finding is injected, in the background, identical to one of them, misplaced, unknown, or wrong. What counts as
identical is the table of effects that no motion separates, fixed before any verdict was scored: asymmetric Coulomb
friction is Coulomb friction and an offset; a rotor is the inertia of its link where no motion separates them; a
linear spring is a cable; a payload is a change of its link; an equal delay is viscous friction. Where joints stick,
friction that turns early is a part of their friction.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from armlab.common.errors import InputError
from armlab.proof.blind.formats import LinkDeviation, TrueEffect, Truth, read_model

FAILURE_FILE = "failed.txt"  # in the place of a verdict: the error message of a diagnosis that failed
STEPS_FILE = "steps.json"  # beside a verdict: the moves and tests of the diagnosis
TIME_FILE = "time.json"  # beside a verdict: how long the diagnosis took; written last, when the verdict is complete
UNKNOWN_NAME = "unknown"  # of a finding without a name
VALID_STATUSES = ("mismatch", "none", "inconclusive")
MISSING_VERDICT: dict[str, Any] = {"status": "invalid", "findings": [], "unexplained": [], "fit": []}


@dataclass(frozen=True, eq=False)
class JudgedCase:
    """One case: its answer, its verdict (`status` invalid where there is none), and how long the diagnosis took.

    recording, clean: the recording folder, and the file with the held-out torque without noise. folder: where the
    verdict is.
    """

    truth: Truth
    verdict: dict[str, Any]
    recording: Path
    clean: Path
    folder: Path
    seconds: float | None

    @property
    def name(self) -> str:
        """The case's name."""
        return self.truth.case

    @property
    def findings(self) -> list[dict[str, Any]]:
        """What was found, most important first."""
        return list(self.verdict["findings"])

    @property
    def says_unknown(self) -> bool:
        """True if the verdict says that something is there that it cannot name."""
        named = any(finding["effect"] == UNKNOWN_NAME for finding in self.findings)
        return named or bool(self.verdict["unexplained"])

    @property
    def unknown_probability(self) -> float:
        """The largest probability that a finding is none of the names; 1 for one without any probability."""
        unknown = [each.get("probability", 1.0) for each in self.findings if each["effect"] == UNKNOWN_NAME]
        members = (member for each in self.findings for member in each.get("class") or [])
        unknown += [member["probability"] for member in members if member["effect"] == UNKNOWN_NAME]
        return float(max(unknown, default=0.0))


def read_cases(folder: Path, verdicts: Path, names: Sequence[str]) -> list[JudgedCase]:
    """All cases of a set; a missing or invalid verdict is kept as one that found nothing."""
    out = []
    for name in names:
        answer, own = folder / "truth" / f"{name}.json", verdicts / name
        truth = read_model(Truth, answer)
        recording, clean = folder / "observations" / name, answer.with_suffix(".parquet")
        out.append(JudgedCase(truth, _read_verdict(own / "verdict.json"), recording, clean, own, _read_seconds(own)))
    if all(case.verdict["status"] == "invalid" for case in out):
        raise InputError(
            f"{verdicts} holds no valid verdict: one is expected in {verdicts / names[0] / 'verdict.json'}"
        )
    return out


def read_complaint(folder: Path) -> str:
    """Why there is no verdict in a folder, in one line; empty where there is one.

    It is the last line of the error output: armlab's message, or the exception at the end of a traceback, without the
    paths of the machine above it.
    """
    path = folder / FAILURE_FILE
    lines = path.read_text(encoding="utf-8").split("\n") if path.is_file() else []
    said = [line.strip() for line in lines if line.strip()]
    return said[-1] if said else ("no error output" if path.is_file() else "")


def _read_verdict(path: Path) -> dict[str, Any]:
    try:
        verdict = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return MISSING_VERDICT
    return verdict if _is_valid_verdict(verdict) else MISSING_VERDICT


def _is_valid_verdict(verdict: Any) -> bool:
    """What the score relies on; a verdict without it counts as none at all."""
    if not isinstance(verdict, dict) or verdict.get("status") not in VALID_STATUSES:
        return False
    lists = (verdict.get(key) for key in ("findings", "unexplained", "fit"))
    if not all(isinstance(each, list) and all(isinstance(item, dict) for item in each) for each in lists):
        return False
    needed = {"effect", "joint", "parameters", "rivals"}
    return all(
        needed <= finding.keys()
        and isinstance(finding["parameters"], dict)
        and isinstance(finding["rivals"], list)
        and all(isinstance(rival, dict) and "effect" in rival for rival in finding["rivals"])
        for finding in verdict["findings"]
    )


def _read_seconds(folder: Path) -> float | None:
    path = folder / TIME_FILE
    return float(json.loads(path.read_text(encoding="utf-8"))["seconds"]) if path.is_file() else None


Category = Literal["injected", "background", "identical", "misplaced", "unknown", "wrong"]
RIGHT_CATEGORIES: tuple[Category, ...] = ("injected", "background", "identical")
CONTAINED_EFFECTS = {  # what the law of an effect holds as a part
    "stribeck_friction": ("coulomb_friction", "viscous_friction"),
    "asymmetric_friction": ("coulomb_friction", "torque_offset", "viscous_friction"),
    "presliding_hysteresis": ("coulomb_friction",),
    "friction_curve": ("coulomb_friction", "viscous_friction"),
    "friction_drift": ("viscous_friction",),
    "cable_stiffness": ("gravity_compensator", "torque_offset"),
    "gravity_compensator": ("cable_stiffness", "torque_offset"),
    "payload": ("inertial_parameter_error",),
    "inertial_parameter_error": ("payload",),
    "rotor_inertia": ("inertial_parameter_error",),
    "torque_gain_error": ("inertial_parameter_error",),
    "sticky_patches": ("coulomb_friction",),
}
EARLY_FRICTION, DRY_FRICTION = "early_friction", ("coulomb_friction", "stribeck_friction")
DELAY_LIKE_EFFECTS = ("viscous_friction",)


def categorize_finding(case: JudgedCase, finding: dict[str, Any]) -> Category:
    """The category of one finding of a case; see the module."""
    truth, name = case.truth, finding["effect"]
    if name == UNKNOWN_NAME:
        return "injected" if any(effect.outside for effect in truth.injected) else "unknown"
    if any(is_same_effect(finding, effect) for effect in truth.injected):
        return "injected"
    if any(is_same_effect(finding, effect) for effect in truth.present):
        return "background"
    if name == EARLY_FRICTION and _sticks(truth, finding["joint"]):
        return "background"
    if any(_is_identical(finding, effect, truth) for effect in truth.present):
        return "identical"
    if _is_sum_of_parts(finding, truth):
        return "identical"
    return "misplaced" if any(name == effect.effect for effect in truth.injected) else "wrong"


def is_same_effect(finding: dict[str, Any], effect: TrueEffect | LinkDeviation) -> bool:
    """The same name at the same place."""
    return bool(finding["effect"] == effect.effect and finding["joint"] == effect.joint)


def _is_identical(finding: dict[str, Any], effect: TrueEffect | LinkDeviation, truth: Truth) -> bool:
    what, where = (finding["effect"], finding["joint"]), (effect.effect, effect.joint)
    return is_indistinguishable(*what, *where, truth.joints, truth.absorbed_rotors)


def is_indistinguishable(
    found: str, place: int | None, effect: str, joint: int | None, joints: int, absorbed_rotors: Sequence[int]
) -> bool:
    """True for a name at a place that no motion separates from an effect at a joint, or that is a part of its law.

    joints: of the arm. absorbed_rotors: joints whose rotor no motion separates from the links.
    """
    if effect == "time_delay":
        return found in DELAY_LIKE_EFFECTS
    if effect == "slosh":
        return found in ("payload", "inertial_parameter_error") and place == joints
    if found == "rotor_inertia" and effect == "inertial_parameter_error":
        return place in absorbed_rotors
    if found not in CONTAINED_EFFECTS.get(effect, ()) or place is None or joint is None:
        return False
    if found == "payload":
        return place == joints and abs(place - joint) <= 1
    if found != "inertial_parameter_error":
        return place == joint
    if effect == "payload":
        return abs(place - joint) <= 1
    return place >= joint


def _sticks(truth: Truth, joint: int) -> bool:
    """Whether a joint (from 1) stands still at its reversals, so that its friction turns before it does."""
    return truth.engine == "sticking" and any(
        each.effect in DRY_FRICTION and each.joint == joint for each in truth.present
    )


def _is_sum_of_parts(finding: dict[str, Any], truth: Truth) -> bool:
    """Asymmetric friction where Coulomb friction and an offset are both there."""
    if finding["effect"] != "asymmetric_friction":
        return False
    there = {each.effect for each in (*truth.injected, *truth.background) if each.joint == finding["joint"]}
    return {"coulomb_friction", "torque_offset"} <= there
