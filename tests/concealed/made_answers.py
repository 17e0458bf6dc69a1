"""Answers written by hand, and verdicts judged by them."""

from pathlib import Path
from typing import Any

from armlab.concealed.score.cases import JudgedCase
from armlab.concealed.score.rows import ScoreRows, make_rows


def effect(
    name: str, joint: int | None, multiple: float = 8.0, outside: bool = False, **values: float
) -> dict[str, Any]:
    parameters = {key: {"value": value, "unit": "1", "comparable": True} for key, value in values.items()}
    about: dict[str, Any] = {"equivalent": []}
    about |= {"form": "x", "obvious_form": True, "size": 1.0, "shape": {}, "target": multiple, "joints": [joint]}
    return {"effect": name, "joint": joint, "outside": outside, "multiple": multiple, "parameters": parameters, **about}


def truth(
    *injected: dict[str, Any], kind: str = "single", background: tuple[dict[str, Any], ...] = (), cad: int = 0
) -> dict[str, Any]:
    return {
        "case": "c",
        "tier": "clean",
        "kind": kind,
        "arm": "irb120-arm",
        "joints": 3,
        "injected": list(injected),
        "background": list(background),
        "cad_errors": [{"effect": "inertial_parameter_error", "joint": link} for link in range(1, cad + 1)],
        "absorbed_rotors": [1, 2],
        "noise": {"kind": "white"},
    }


def judged(answer: dict[str, Any], said: dict[str, Any], name: str = "c") -> JudgedCase:
    return JudgedCase({**answer, "case": name}, said, Path("none"), Path("none"), Path("none"), 2.0)


def scored(*pairs: tuple[dict[str, Any], dict[str, Any]]) -> ScoreRows:
    return make_rows([judged(answer, said, f"c{number}") for number, (answer, said) in enumerate(pairs)])


NULL = truth(kind="null")
COULOMB = truth(effect("coulomb_friction", 2, level=2.0))
OUTSIDE = truth(effect("viscous_map", 1, outside=True), kind="outside")
