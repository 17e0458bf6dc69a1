"""A finding in a plain sentence, with its numbers: what the model lacks, or how the arm differs from it."""

import math
import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import starmap

import numpy as np

from armlab.common.report.wording import format_unit
from armlab.diagnosis.result import Claim
from armlab.diagnosis.torque.rows.simulation import Simulation
from armlab.effects.contract import Effect
from armlab.effects.library import effect_named
from armlab.effects.parameters import Interval, ParameterValue
from armlab.effects.words import place_in_words
from armlab.report.words import (
    format_fixed,
    format_measured,
    is_doubtful,
    is_negative_load,
    may_be_zero,
)
from problem.joint_words import joint_in_words

MILLI = 1e3  # mm in a m


def finding_sentence(claim: Claim, simulation: Simulation) -> str:
    """One finding with its numbers, without rivals and without a full stop."""
    facts, model = _facts(claim), model_in_words(simulation)
    place = place_in_words(simulation.arm, claim.effect, claim.joint, claim.joints)
    if not facts.sentence:
        return _begin(f"{model} lacks {facts.words} at {place}", is_doubtful(claim))
    sentence = facts.sentence.format(model=model, place=place)
    if is_negative_load(claim):
        sentence = f"The arm has less mass than {model}"
    figures = claim_figures(claim, simulation)
    return _begin(sentence, is_doubtful(claim)) + (f": {figures}" if figures else "")


def claim_figures(claim: Claim, simulation: Simulation) -> str:
    """The numbers of a finding: `2.00 kg (1.998 to 2.003) at (0, 20, 60) mm of wrist_3`."""
    parameters = claim.parameters
    if is_negative_load(claim):
        parameters = tuple(_as_less(each) if each.name == "mass" else each for each in parameters)
    return _figures(_facts(claim), parameters, _frame(claim, simulation))


def _as_less(mass: ParameterValue) -> ParameterValue:
    """A mass of the other sign."""
    interval: Interval | None = None
    if mass.interval is not None:
        low, high = np.asarray(mass.interval, dtype=float).tolist()
        interval = (-high, -low)
    return replace(mass, value=-float(np.asarray(mass.value)), interval=interval)


def _frame(claim: Claim, simulation: Simulation) -> str:
    return "" if claim.joint is None else joint_in_words(simulation.arm, claim.joint)


def model_in_words(simulation: Simulation) -> str:
    """What the recording is compared with, in a sentence."""
    return "the rigid-body model" if simulation.kind == "refit" else "the simulation"


def _facts(claim: Claim) -> Effect:
    return effect_named(claim.effect)


def simulated_figures(claim: Claim) -> str:
    """What the simulation has already of the law of a finding: `2.00 N m`; empty where it has none."""
    present = [
        replace(each, value=claim.simulated[each.name], interval=None)
        for each in claim.parameters
        if each.name in claim.simulated
    ]
    return _figures(_facts(claim), present, "")


def _figures(facts: Effect, parameters: Sequence[ParameterValue], frame: str) -> str:
    """`2.00 kg (1.998 to 2.003) at (0, 20, 60) mm of wrist_3`; where a law has other numbers, these by name."""
    values = {each.name: _format_value(each) for each in parameters}
    if not facts.figures:
        first = next((each for each in parameters if np.ndim(each.value) == 0), None)
        if first is None:
            return ""
        name = number_in_words(first.name)
        if not facts.in_links:
            return f"{name} {values[first.name]}"
        if may_be_zero(first):
            return f"{name} perhaps {values[first.name]}"
        is_lighter = first.name == "mass" and float(np.asarray(first.value)) < 0
        return f"{_format_value(_as_less(first))} less mass" if is_lighter else f"{name} {values[first.name]}"
    if not values:
        return ""
    try:
        return facts.figures.format(frame=frame, **values)
    except KeyError:  # as of a body of which this arm feels only some numbers
        return ", ".join(f"{number_in_words(name)} {value}" for name, value in values.items())


def number_in_words(name: str) -> str:
    """The name of a number of a law in a sentence: m, mcx and Ixx are mass, first moment and inertia of a link."""
    if name == "m":
        return "mass"
    if found := re.fullmatch(r"(mc|I)([xyz]{1,2})", name):
        return f"{'first moment' if found[1] == 'mc' else 'inertia'} {found[2]}"
    return name.replace("_", " ")


def _format_value(parameter: ParameterValue) -> str:
    """A scalar with its interval; a vector without, lengths in mm as fine as they are known."""
    if np.ndim(parameter.value) == 0:
        return format_measured(parameter)
    values = np.asarray(parameter.value, dtype=float)
    if parameter.unit == "m":
        return f"({', '.join(starmap(_millimetres, zip(values, _half_widths(parameter), strict=True)))}) mm"
    return f"({', '.join(format_fixed(value) for value in values.tolist())}) {format_unit(parameter.unit)}"


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


def _begin(sentence: str, doubtful: bool) -> str:
    """The sentence with its first letter large, or behind `Perhaps`."""
    return f"Perhaps {sentence[0].lower()}{sentence[1:]}" if doubtful else (sentence[0].upper() + sentence[1:])
