"""A diagnosis as verdict/1: plain dicts and lists, as `verdict.json` holds them."""

import math
from typing import Any

from diagnosis.result import Claim, Diagnosis, JointFit, Located, Parameter, Unexplained

SCHEMA = "verdict/1"


def verdict(diagnosis: Diagnosis) -> dict[str, Any]:
    """The verdict of a diagnosis."""
    return {
        "schema": SCHEMA,
        "status": diagnosis.status,
        "summary": diagnosis.summary,
        "located": [_located(each) for each in diagnosis.located],
        "findings": [_finding(each) for each in diagnosis.claims],
        "unexplained": [_unexplained(each) for each in diagnosis.unexplained],
        "fit": [_fit(each) for each in diagnosis.fit],
    }


def _located(each: Located) -> dict[str, Any]:
    where: dict[str, Any] = {"variable": each.variable, "regime": each.regime, "runs": list(each.runs)}
    where["time"] = None if each.time is None else list(each.time)
    return {"joint": each.joint, "share": each.share, "where": where}


def _finding(claim: Claim) -> dict[str, Any]:
    rivals = [{"effect": each.effect, "joint": each.joint} for each in claim.rivals]
    return {
        "effect": claim.effect,
        "joint": claim.joint,
        "joints": list(claim.joints),
        "parameters": {each.name: _parameter(each) for each in claim.parameters},
        "equation": claim.equation,
        "heldout_rms_before": claim.evidence.rms_before,
        "heldout_rms_after": claim.evidence.rms_after,
        "p_value": claim.evidence.corrected,
        "rivals": rivals,
        "next_experiment": claim.next_experiment,
    }


def _parameter(each: Parameter) -> dict[str, Any]:
    value = list(each.value) if isinstance(each.value, tuple) else _finite(each.value)
    interval = None if each.interval is None else [list(x) if isinstance(x, tuple) else x for x in each.interval]
    return {"value": value, "ci95": interval, "unit": each.unit}


def _finite(value: float) -> float:
    return value if math.isfinite(value) else math.copysign(1e300, value)  # JSON has no infinity


def _unexplained(each: Unexplained) -> dict[str, Any]:
    return {"joint": each.joint, "share": each.share, "depends_on": list(each.depends_on)}


def _fit(each: JointFit) -> dict[str, Any]:
    return {
        "joint": each.joint,
        "heldout_rms_before": each.before,
        "heldout_rms_after": each.after,
        "noise_floor": each.noise_floor,
        "gap_closed": each.gap_closed,
    }
