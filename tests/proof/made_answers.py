"""Answers written by hand, and verdicts judged by them."""

from pathlib import Path
from typing import Any

from armlab.proof.blind.formats import (
    CaseKind,
    InjectedEffect,
    LinkDeviation,
    TrueEffect,
    TrueNoise,
    TrueParameter,
    Truth,
)
from armlab.proof.blind.score.cases import JudgedCase
from armlab.proof.blind.score.rows import ScoreRows, make_rows


def effect(
    name: str, joint: int | None, multiple: float = 8.0, outside: bool = False, **values: float
) -> InjectedEffect:
    return InjectedEffect(
        effect=name,
        joint=joint,
        joints=() if joint is None else (joint,),
        outside=outside,
        form="x",
        obvious_form=True,
        equivalent=(),
        parameters={key: TrueParameter(value=value, unit="1", comparable=True) for key, value in values.items()},
        size=1.0,
        shape={},
        target=multiple,
        multiple=multiple,
    )


def truth(
    *injected: InjectedEffect, kind: CaseKind = "single", background: tuple[TrueEffect, ...] = (), cad: int = 0
) -> Truth:
    return Truth(
        schema="truth/1",
        case="c",
        tier="clean",
        kind=kind,
        arm="irb120-arm",
        joints=3,
        rate_hz=500,
        motions=("fourier", "chirp"),
        injected=injected,
        passed_over=(),
        background=background,
        cad_errors=tuple(
            LinkDeviation(effect="inertial_parameter_error", joint=link, relative=0.05) for link in range(1, cad + 1)
        ),
        absorbed_rotors=(1, 2),
        noise=TrueNoise(kind="white", white=(0.1, 0.1, 0.1), coloured=(0.0, 0.0, 0.0), corner_hz=5.0),
        noise_floor=(0.1, 0.1, 0.1),
    )


def judged(answer: Truth, said: dict[str, Any], name: str = "c") -> JudgedCase:
    return JudgedCase(answer.model_copy(update={"case": name}), said, Path("none"), Path("none"), Path("none"), 2.0)


def scored(*pairs: tuple[Truth, dict[str, Any]]) -> ScoreRows:
    return make_rows([judged(answer, said, f"c{number}") for number, (answer, said) in enumerate(pairs)])


NULL = truth(kind="null")
COULOMB = truth(effect("coulomb_friction", 2, level=2.0))
OUTSIDE = truth(effect("viscous_map", 1, outside=True), kind="outside")
