"""Findings in plain sentences: what the model lacks, and what else differs between the arm and the model.

An effect that a model can simply lack stands in a list: `The simulation lacks viscous friction at joints 1 and 2`.
Every other effect says in a sentence of its own what was found (`Effect.sentence`), with its numbers.
"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import starmap

import numpy as np

from armlab.common.report.numbers import format_unit
from armlab.diagnosis.report.words import effect_in_words, format_fixed, format_measured, join_words, place_in_words
from armlab.diagnosis.result import Claim
from armlab.diagnosis.simulation import Simulation
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.library import effect_named
from armlab.effects.parameters import ParameterValue

MILLI = 1e3  # mm in a m


def findings_in_sentences(claims: Sequence[Claim], simulation: Simulation, most: int) -> str:
    """All that the model lacks, then the first `most` effects that differ; the others are counted, and what is unknown
    is told. Empty without findings.
    """
    unknown = [claim for claim in claims if claim.effect == UNKNOWN.id]
    lacking = [claim for claim in claims if claim.effect != UNKNOWN.id and not _facts(claim).sentence]
    differing: dict[tuple[str, str], list[Claim]] = {}
    for claim in claims:
        if claim.effect != UNKNOWN.id and _facts(claim).sentence:
            differing.setdefault((claim.effect, rivals_in_words(claim)), []).append(claim)
    groups = list(differing.values())
    sentences = [_lacking_sentence(lacking, simulation)] if lacking else []
    sentences += [_differing_sentence(own, simulation) for own in groups[:most]]
    sentences += _count_sentence(sum(len(own) for own in groups[most:]))
    if unknown:
        sentences.append(UNKNOWN.sentence.format(place=_places(unknown)))
    return " ".join(f"{each}." for each in sentences)


def _differing_sentence(claims: Sequence[Claim], simulation: Simulation) -> str:
    """One effect where it was found, with its numbers; of several places without intervals."""
    rivals = rivals_in_words(claims[0])
    also = f"; {rivals} fits as well" if rivals else ""
    if len(claims) == 1:
        return finding_sentence(claims[0], simulation) + also
    ordered = sorted(claims, key=lambda each: each.joint or 0)
    facts = _facts(claims[0])
    sentence = facts.sentence.format(model=model_in_words(simulation), place=_places(ordered))
    numbers = [
        _figures(facts, [replace(one, interval=None) for one in each.parameters], _frame(each, simulation))
        for each in ordered
    ]
    shown = [each for each in numbers if each]
    return _capitalise(sentence) + (f": {join_words(shown)}" if shown else "") + also


def finding_sentence(claim: Claim, simulation: Simulation) -> str:
    """One finding with its numbers, without rivals and without a full stop."""
    facts, place, model = _facts(claim), _places([claim]), model_in_words(simulation)
    if not facts.sentence:
        return _capitalise(f"{model} lacks {facts.words} at {place}")
    sentence = facts.sentence.format(model=model, place=place)
    figures = _figures(facts, claim.parameters, _frame(claim, simulation))
    return _capitalise(sentence) + (f": {figures}" if figures else "")


def _frame(claim: Claim, simulation: Simulation) -> str:
    return "" if claim.joint is None else simulation.arm.joints[claim.joint - 1].name


def model_in_words(simulation: Simulation) -> str:
    """What the recording is compared with, in a sentence."""
    return "the rigid-body model" if simulation.kind == "refit" else "the simulation"


def _facts(claim: Claim) -> Effect:
    return effect_named(claim.effect)


def _lacking_sentence(claims: Sequence[Claim], simulation: Simulation) -> str:
    """What the model lacks, one effect at several joints together where its rivals are the same."""
    groups: dict[tuple[str, str], list[Claim]] = {}
    for claim in sorted(claims, key=lambda each: each.joint or 0):
        groups.setdefault((claim.effect, rivals_in_words(claim)), []).append(claim)
    lacking = [
        f"{effect_in_words(effect)}{_size(own)} at {_places(own)}{f' (or {rivals})' if rivals else ''}"
        for (effect, rivals), own in groups.items()
    ]
    return _capitalise(f"{model_in_words(simulation)} of {simulation.arm.name} lacks {join_words(lacking)}")


def _size(claims: Sequence[Claim]) -> str:
    """` of 3.03 N m s/rad` of a single finding."""
    if len(claims) > 1:
        return ""
    bare = [replace(each, interval=None) for each in claims[0].parameters]
    figures = _figures(_facts(claims[0]), bare, "")
    return f" of {figures}" if figures else ""


def _places(claims: Sequence[Claim]) -> str:
    """`joints 1 and 3`, `joint 2 from joint 1`, `the whole robot`."""
    places = [place_in_words(claim.effect, claim.joint, claim.joints) for claim in claims]
    if len(places) > 1 and all(re.fullmatch(r"(joint|link) \d+", each) for each in places):
        what = places[0].split()[0]
        return f"{what}s {join_words([each.split()[1] for each in places])}"
    return join_words(places)


def rivals_in_words(claim: Claim) -> str:
    """Other effects that fit as well: `Stribeck friction or friction drift`; empty where there is none."""
    names = dict.fromkeys(effect_in_words(each.effect) for each in claim.rivals if each.effect != claim.effect)
    return join_words(list(names), "or") if names else ""


def _count_sentence(number: int) -> Iterator[str]:
    if number > 0:
        yield f"There {'is 1 more finding' if number == 1 else f'are {number} more findings'}"


def _figures(facts: Effect, parameters: Sequence[ParameterValue], frame: str) -> str:
    """`2.00 kg (1.998 to 2.003) at (0, 20, 60) mm of wrist_3`; where a law has other numbers, these by name."""
    values = {each.name: _format_value(each) for each in parameters}
    if not facts.figures:
        first = next((each for each in parameters if np.ndim(each.value) == 0), None)
        return "" if first is None else f"{number_in_words(first.name)} {values[first.name]}"
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


def _capitalise(sentence: str) -> str:
    return sentence[0].upper() + sentence[1:]
