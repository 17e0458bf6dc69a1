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

from armlab.common.report.wording import format_unit, join_words
from armlab.diagnosis.report.words import (
    effect_in_words,
    format_fixed,
    format_measured,
    is_doubtful,
    is_excess,
    is_negative_load,
    may_be_zero,
)
from armlab.diagnosis.result import Claim
from armlab.diagnosis.simulation import Simulation
from armlab.effects.contract import UNKNOWN, Effect
from armlab.effects.library import effect_named
from armlab.effects.parameters import Interval, ParameterValue
from armlab.effects.words import place_in_words
from problem.arm import Arm
from problem.joint_words import joint_in_words, joints_in_words, links_in_words

MILLI = 1e3  # mm in a m


def findings_in_sentences(claims: Sequence[Claim], simulation: Simulation, most: int) -> str:
    """All that the model lacks, then the first `most` effects that differ; the others are counted, and what is unknown
    is told. Empty without findings.
    """
    unknown = [claim for claim in claims if claim.effect == UNKNOWN.id]
    lacking = [claim for claim in claims if claim.effect != UNKNOWN.id and not _facts(claim).sentence]
    differing: dict[tuple[str, str, bool], list[Claim]] = {}
    for claim in claims:
        if claim.effect != UNKNOWN.id and _facts(claim).sentence:
            differing.setdefault((claim.effect, rivals_in_words(claim), is_doubtful(claim)), []).append(claim)
    groups = list(differing.values())
    sentences = list(_sentences_of_lists(lacking, simulation))
    sentences += [_differing_sentence(own, simulation) for own in groups[:most]]
    sentences += _count_sentence(sum(len(own) for own in groups[most:]))
    if unknown:
        sentences.append(UNKNOWN.sentence.format(place=_places(simulation.arm, unknown)))
    return " ".join(f"{each}." for each in sentences)


def _differing_sentence(claims: Sequence[Claim], simulation: Simulation) -> str:
    """One effect where it was found, with its numbers; of several places without intervals."""
    rivals = rivals_in_words(claims[0])
    also = f"; or it is {rivals}" if rivals else ""
    if len(claims) == 1:
        return finding_sentence(claims[0], simulation) + also
    ordered = sorted(claims, key=lambda each: each.joint or 0)
    facts = _facts(claims[0])
    sentence = facts.sentence.format(model=model_in_words(simulation), place=_places(simulation.arm, ordered))
    numbers = [
        _figures(facts, [replace(one, interval=None) for one in each.parameters], _frame(each, simulation))
        for each in ordered
    ]
    shown = [each for each in numbers if each]
    return _begin(sentence, is_doubtful(claims[0])) + (f": {join_words(shown)}" if shown else "") + also


def finding_sentence(claim: Claim, simulation: Simulation) -> str:
    """One finding with its numbers, without rivals and without a full stop."""
    facts, place, model = _facts(claim), _places(simulation.arm, [claim]), model_in_words(simulation)
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


def _sentences_of_lists(claims: Sequence[Claim], simulation: Simulation) -> Iterator[str]:
    """What the model lacks, and what it has too much of."""
    subject = f"{model_in_words(simulation)} of {simulation.arm.name}"
    for verb, own in (
        ("lacks", [each for each in claims if not is_excess(each)]),
        ("has too much", [each for each in claims if is_excess(each)]),
    ):
        if own:
            yield _capitalise(f"{subject} {verb} {_list_in_words(own, simulation)}")
            subject = "it"


def _list_in_words(claims: Sequence[Claim], simulation: Simulation) -> str:
    """Effects, with one place for all that have it, and their rivals, in common."""
    groups: dict[tuple[bool, str, str], list[Claim]] = {}
    for claim in sorted(claims, key=lambda each: each.joint or 0):
        groups.setdefault((is_doubtful(claim), claim.effect, rivals_in_words(claim)), []).append(claim)
    names_by_place: dict[str, list[str]] = {}
    for (doubtful, effect, rivals), own in sorted(groups.items(), key=lambda group: group[0][0]):
        place = f"{_places(simulation.arm, own)}{f' (or {rivals})' if rivals else ''}"
        name = f"{'perhaps ' if doubtful else ''}{effect_in_words(effect)}{_size(own)}"
        names_by_place.setdefault(place, []).append(name)
    return join_words([f"{join_words(names)} at {place}" for place, names in names_by_place.items()])


def _size(claims: Sequence[Claim]) -> str:
    """` of 3.03 N m s/rad (it has 1.50 N m s/rad)` of a single finding, the second where the model has some already."""
    if len(claims) > 1:
        return " beyond what it has" if any(each.simulated and not is_excess(each) for each in claims) else ""
    claim = claims[0]
    figures = _figures(_facts(claim), [_without_interval(each, is_excess(claim)) for each in claim.parameters], "")
    present = simulated_figures(claim)
    return (f" of {figures}" if figures else "") + (f" (it has {present})" if present else "")


def _without_interval(parameter: ParameterValue, turned: bool) -> ParameterValue:
    """A parameter without its interval. turned: with the other sign, of a scalar."""
    turned = turned and np.ndim(parameter.value) == 0
    value = -float(np.asarray(parameter.value)) if turned else parameter.value
    return replace(parameter, value=value, interval=None)


def simulated_figures(claim: Claim) -> str:
    """What the simulation has already of the law of a finding: `2.00 N m`; empty where it has none."""
    present = [
        replace(each, value=claim.simulated[each.name], interval=None)
        for each in claim.parameters
        if each.name in claim.simulated
    ]
    return _figures(_facts(claim), present, "")


def _places(arm: Arm, claims: Sequence[Claim]) -> str:
    """Where an effect is: `joints 1 and 3`, `elbow from shoulder_lift`, `the whole robot`."""
    joints = [claim.joint for claim in claims if claim.joint is not None and len(claim.joints) < 2]
    if len(joints) < len(claims):
        return join_words([place_in_words(arm, claim.effect, claim.joint, claim.joints) for claim in claims])
    is_link = _facts(claims[0]).where == "link"
    return links_in_words(arm, joints) if is_link else joints_in_words(arm, joints)


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
    return f"Perhaps {sentence[0].lower()}{sentence[1:]}" if doubtful else _capitalise(sentence)


def _capitalise(sentence: str) -> str:
    return sentence[0].upper() + sentence[1:]
