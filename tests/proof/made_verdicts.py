"""Verdicts written by hand: perfect, silent, or wrong."""

import json
from pathlib import Path
from typing import Any

from armlab.proof.blind.formats import TrueEffect, Truth


def verdict(status: str = "none", findings: tuple[dict[str, Any], ...] = (), **more: Any) -> dict[str, Any]:
    rest = {"located": [], "unexplained": [], "fit": [], "summary": "a verdict that was written by hand"}
    return {"schema": "verdict/1", "status": status, "findings": list(findings), **rest, **more}


def finding(
    effect: str, joint: int | None, parameters: dict[str, Any] | None = None, rivals: tuple[str, ...] = ()
) -> dict[str, Any]:
    listed = [{"effect": rival, "joint": joint} for rival in rivals]
    figures = {"equation": "", "heldout_rms_before": 1.0, "heldout_rms_after": 0.1}
    return {"effect": effect, "joint": joint, "parameters": parameters or {}, "rivals": listed, **figures}


def perfect(truth: Truth) -> dict[str, Any]:
    """What was hidden and what was in the background, each with its parameters."""
    if any(effect.outside for effect in truth.injected):
        hidden = [finding("unknown", truth.injected[0].joint)]
    else:
        hidden = [_found(effect) for effect in truth.injected]
    background = [_found(effect) for effect in truth.background]
    return verdict("mismatch" if hidden or background else "none", (*hidden, *background))


def write(folder: Path, case: str, content: dict[str, Any] | str) -> None:
    path = folder / case / "verdict.json"
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(content if isinstance(content, str) else json.dumps(content), encoding="utf-8")


def _found(effect: TrueEffect) -> dict[str, Any]:
    def about(value: float | tuple[float, ...]) -> list[float] | None:
        return None if isinstance(value, tuple) else [value - 0.1 * abs(value), value + 0.1 * abs(value)]

    parameters = {
        name: {"value": known.value, "ci95": about(known.value), "unit": known.unit}
        for name, known in effect.parameters.items()
    }
    return finding(effect.effect, effect.joint, parameters)
