"""Probabilities calibrated: the weights of a conditional logit model from findings whose truth is known, and a check.

The check leaves out cases in turn: the probabilities of a case are those of weights that were found without it. Cases
of one real recording are left out together, for they share the arm and what its model lacks. The lapse is found on
cases that were left out, too.
"""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from sklearn.metrics import brier_score_loss, log_loss

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.statistics import wilson_interval
from armlab.diagnosis.choice import Example, Weights, fit_lapse, fit_weights, probabilities, with_lapse

FOLDS = 5
BINS = (0.0, 0.5, 0.7, 0.9, 1.0)
# Stated before any finding: no number speaks for or against a name, and no effect is likelier than another one. How far
# a weight may be from that, a standard deviation: an effect twice as likely as another one is usual (log 2 = 0.7).
# How many effects stand at a joint, and whether something is left at others, is how a set was drawn: a real arm has
# several of each, so little may be learnt of that.
EFFECT_PREFIX, EFFECT_SPREAD, SPREAD = "is ", 0.7, 2.0
COMPANY, COMPANY_SPREAD = ("found beside", "found crowd", "found structure elsewhere", "structure beside"), 0.3
NARROWER = (1.0, 0.7, 0.5, 0.35)  # times these spreads: the one is kept that makes cases left out likeliest
CONFIDENCE = 0.95
HELD = 1e-3  # of a weight that is known, a standard deviation: it stays as it is
KnownWeights = Callable[[str], Weights]  # without a real recording, or of all for an empty name


def nothing_known(_: str) -> Weights:
    """No weight is known yet."""
    return Weights({})


@dataclass(frozen=True)
class ExampleFinding:
    """A finding whose truth is known. background: of what every case of its tier has, which is no discovery.

    recording: the real one that it is from; empty for a simulated one.
    """

    case: str
    tier: str
    example: Example
    background: bool
    recording: str = ""


@dataclass(frozen=True)
class ReliabilityBin:
    """Findings whose likeliest answer has a probability from `low` to `high`. mean: of them; right: how many are."""

    low: float
    high: float
    findings: int
    mean: float
    right: int

    @property
    def interval(self) -> tuple[float, float]:
        """Wilson's, of the share that is right."""
        return wilson_interval(self.right, self.findings, CONFIDENCE)


@dataclass(frozen=True)
class Reliability:
    """How well probabilities hold on cases that were left out. brier, log: scores, and those of the base rate."""

    bins: tuple[ReliabilityBin, ...]
    brier: tuple[float, float]
    log: tuple[float, float]


@dataclass(frozen=True)
class Calibration:
    """Weights, and how well they hold by tier: of findings beyond background, in cases that were left out in turn.

    left_out: the weights without each real recording. narrower: of `NARROWER`, the one that was kept.
    """

    weights: Weights
    left_out: dict[str, Weights]
    narrower: float
    findings: int
    tiers: dict[str, Reliability]


@dataclass(frozen=True, eq=False)
class LeftOut:
    """Findings judged by weights that do not know them.

    weights: without each group that is left out together, their lapse included. chances: of each finding, (names,).
    loss: log loss of findings beyond background, nats in all.
    """

    weights: dict[Hashable, Weights]
    chances: tuple[Array, ...]
    loss: float


def calibrate(findings: Sequence[ExampleFinding], known: KnownWeights = nothing_known) -> Calibration:
    """The weights of everything that speaks for a name, and their reliability.

    known: weights that stay, the lapse with them: those of other numbers are learnt beside them.
    Raises InputError where all findings are of one case or recording, so that none can be left out.
    """
    tried = {narrower: leave_out(findings, narrower, known) for narrower in NARROWER}
    narrower = min(tried, key=lambda each: tried[each].loss)
    best, tiers = tried[narrower], {}
    for tier in sorted({each.tier for each in findings}):
        own = [at for at, each in enumerate(findings) if each.tier == tier and not each.background]
        if own:
            chances = [best.chances[at] for at in own]
            tiers[tier] = judge_reliability(chances, [findings[at].example.right for at in own])
    held = known("")
    whole = Weights(
        weights_of([each.example for each in findings], narrower, held),
        held.lapse if held.numbers else float(np.mean([each.lapse for each in best.weights.values()])),
    )
    left_out = {each.recording: best.weights[each.recording] for each in findings if each.recording}
    return Calibration(whole, dict(sorted(left_out.items())), narrower, len(findings), tiers)


def weights_of(examples: Sequence[Example], narrower: float, known: Weights) -> dict[str, float]:
    """The likeliest weights near those that were stated before. narrower: times the spreads that were stated."""
    new = sorted({key for each in examples for name in each.names for key in name} - known.numbers.keys())
    spreads = dict.fromkeys(known.numbers, HELD) | {key: narrower * stated_spread(key) for key in new}
    found = fit_weights(examples, {**known.numbers, **dict.fromkeys(new, 0.0)}, spreads)
    return {**found, **known.numbers}


def stated_spread(key: str) -> float:
    """How far a weight may be from zero, a standard deviation."""
    if key in COMPANY:
        return COMPANY_SPREAD
    return EFFECT_SPREAD if key.startswith(EFFECT_PREFIX) else SPREAD


def leave_out(findings: Sequence[ExampleFinding], narrower: float, known: KnownWeights) -> LeftOut:
    """Leaves out each real recording and each fold of simulated cases in turn.

    The lapse of a group is found on the other groups, each by weights that do not know it. narrower: times the spreads;
    known: as for `calibrate`.
    """
    groups = _groups(findings)
    if len(set(groups)) < 2:
        raise InputError("all findings are of one case or one real recording: give more, so that some can be left out")
    before = {group: known(group if isinstance(group, str) else "") for group in dict.fromkeys(groups)}
    plain = {
        group: Weights(
            weights_of(
                [each.example for each, own in zip(findings, groups, strict=True) if own != group], narrower, held
            )
        )
        for group, held in before.items()
    }
    chances = [probabilities(each.example.names, plain[group]) for each, group in zip(findings, groups, strict=True)]
    rights = [each.example.right for each in findings]
    new = [at for at, each in enumerate(findings) if not each.background]
    weights = {}
    for group, own in plain.items():
        others = [at for at in new if groups[at] != group]
        found = fit_lapse([chances[at] for at in others], [rights[at] for at in others])
        weights[group] = Weights(own.numbers, before[group].lapse if before[group].numbers else found)
    judged = tuple(with_lapse(each, weights[group].lapse) for each, group in zip(chances, groups, strict=True))
    loss = -sum(float(np.log(judged[at][np.array(rights[at])].sum())) for at in new if any(rights[at]))
    return LeftOut(weights, judged, loss)


def _groups(findings: Sequence[ExampleFinding]) -> tuple[Hashable, ...]:
    """What is left out together: a real recording, or every fifth simulated case."""
    cases = sorted({each.case for each in findings if not each.recording})
    folds = {case: number % FOLDS for number, case in enumerate(cases)}
    return tuple(each.recording or folds[each.case] for each in findings)


def judge_reliability(chances: Sequence[Array], rights: Sequence[Sequence[bool]]) -> Reliability:
    """How often the likeliest answer is right. chances, rights: of each finding, (answers,)."""
    first = [int(np.argmax(each)) for each in chances]
    stated = np.array([each[at] for each, at in zip(chances, first, strict=True)])
    hits = np.array([each[at] for each, at in zip(rights, first, strict=True)])
    base = np.full(len(hits), hits.mean())
    bins = []
    for low, high in pairwise(BINS):
        own = (stated >= low) & ((stated < high) | (high == BINS[-1]))
        if own.any():
            bins.append(ReliabilityBin(low, high, int(own.sum()), float(stated[own].mean()), int(hits[own].sum())))
    return Reliability(
        tuple(bins),
        (float(brier_score_loss(hits, stated)), float(brier_score_loss(hits, base))),
        (float(log_loss(hits, stated, labels=[0, 1])), float(log_loss(hits, base, labels=[0, 1]))),
    )
