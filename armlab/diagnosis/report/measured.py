"""The numbers of the findings as the first screen shows them: a table of joints and kinds of torque, and the bodies."""

import math
from collections.abc import Sequence
from itertools import starmap

import numpy as np

from armlab.common.report.page import Table
from armlab.diagnosis.report.words import effect_in_words, finding_in_words, format_number, format_unit
from armlab.diagnosis.result import Claim, Diagnosis
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.drive import ROTOR_INERTIA_FACTS
from armlab.effects.friction import COULOMB_FACTS, VISCOUS_FACTS
from armlab.effects.library import effect_named
from armlab.effects.links import PAYLOAD_FACTS
from armlab.effects.parameters import ParameterValue

OWN_COLUMN: tuple[Effect, ...] = (COULOMB_FACTS, VISCOUS_FACTS, ROTOR_INERTIA_FACTS)
NOTHING = "–"
MILLI = 1e3  # mm in a m
VALUE_DIGITS = 3


def joint_table(diagnosis: Diagnosis) -> Table:
    """What is to be added to the simulation, joint by joint, with units and 95 % intervals."""
    arm, rows = diagnosis.simulation.arm, []
    for number, joint in enumerate(arm.joints, 1):
        own = [claim for claim in diagnosis.claims if claim.joint == number and claim.effect != PAYLOAD_FACTS.id]
        rows.append([f"{number}  {joint.name}", *_cells(own)])
    whole = [claim for claim in diagnosis.claims if claim.joint is None]
    if whole:
        rows.append(["whole robot", *_cells(whole)])
    headings = ["joint", *(_heading(effect) for effect in OWN_COLUMN), "other"]
    return Table(headings, rows, (4,), stacked=True)


def _heading(effect: Effect) -> str:
    return effect.words[0].upper() + effect.words[1:]


def _cells(claims: Sequence[Claim]) -> list[str]:
    cells = []
    for effect in OWN_COLUMN:
        own = [claim for claim in claims if claim.effect == effect.id]
        cells.append("; ".join(format_measured(each) for claim in own for each in claim.parameters) or NOTHING)
    columns = {effect.id for effect in OWN_COLUMN}
    others = [_other_cell(claim) for claim in claims if claim.effect not in columns]
    return [*cells, "; ".join(others) or NOTHING]


def _other_cell(claim: Claim) -> str:
    """The effect, and the number that its facts name first."""
    if claim.effect == UNKNOWN.id:
        return "something that no known effect explains"
    words = effect_in_words(claim.effect)
    if effect_named(claim.effect).where == "link":
        words = f"{words} of its link"
    scalars = [each for each in claim.parameters if np.ndim(each.value) == 0]
    return f"{words}: {scalars[0].name.replace('_', ' ')} {format_measured(scalars[0])}" if scalars else words


def format_measured(parameter: ParameterValue) -> str:
    """`2.31 N m (2.28 to 2.34)` of a scalar: three digits, and an interval as fine as it is wide."""
    value, unit = float(np.asarray(parameter.value)), format_unit(parameter.unit)
    shown = f"{format_fixed(value)} {unit}".rstrip()
    if parameter.interval is None:
        return shown
    low, high = np.asarray(parameter.interval, dtype=float).tolist()
    return f"{shown} ({format_interval(low, high)})"


def format_fixed(value: float) -> str:
    """A number with three digits, zeros at its end included."""
    if value and not 1e-4 <= abs(value) < 1e3:
        return format_number(value)
    return f"{value:#.{VALUE_DIGITS}g}".rstrip(".").replace("-", "−")


def format_interval(low: float, high: float) -> str:
    """Both ends with as many decimals as show half the width."""
    half = (high - low) / 2
    if not math.isfinite(half) or half <= 0 or max(abs(low), abs(high)) >= 1e6 or half < 1e-7:
        return f"{format_number(low)} to {format_number(high)}"
    decimals = max(-math.floor(math.log10(half)), 0)
    return f"{low:.{decimals}f} to {high:.{decimals}f}".replace("-", "−")


def body_sentences(diagnosis: Diagnosis) -> list[str]:
    """Each payload with its mass, and where its centre of mass is in the frame of its joint."""
    joints = diagnosis.simulation.arm.joints
    out = []
    for claim in diagnosis.claims:
        if claim.effect != PAYLOAD_FACTS.id or claim.joint is None:
            continue
        named = {each.name: each for each in claim.parameters}
        frame = joints[claim.joint - 1].name
        if "mass" in named and "centre" in named:
            centre = np.asarray(named["centre"].value, dtype=float)
            place = ", ".join(starmap(_millimetres, zip(centre, _half_widths(named["centre"]), strict=True)))
            out.append(f"Payload: {format_measured(named['mass'])} at ({place}) mm of {frame}.")
        else:  # the arm feels only some of its numbers
            felt = [f"{each.name.replace('_', ' ')} {format_measured(each)}" for each in claim.parameters]
            title = finding_in_words(claim)
            out.append(f"{title[0].upper()}{title[1:]} ({frame}), as far as this arm feels it: {', '.join(felt)}.")
    return out


def _half_widths(parameter: ParameterValue) -> list[float]:
    count = np.size(parameter.value)
    if parameter.interval is None:
        return [math.nan] * count
    pairs = np.asarray(parameter.interval, dtype=float).reshape(-1, 2)
    return [float(high - low) / 2 for low, high in pairs]


def _millimetres(value: float, half: float) -> str:
    """A length, m, in whole mm; in tenths where its interval is that narrow."""
    decimals = 1 if MILLI * half < 1.0 else 0
    return f"{round(MILLI * value, decimals) + 0.0:.{decimals}f}".replace("-", "−")  # + 0.0: no minus before a zero
