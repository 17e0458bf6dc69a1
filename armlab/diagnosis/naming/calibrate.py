"""Probabilities calibrated: the weights of a conditional logit model from findings whose truth is known, and a check.

The check leaves out cases in turn: the probabilities of a case are those of weights that were found without it. Cases
of one real recording are left out together, for they share the arm and what its model lacks.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from sklearn.metrics import brier_score_loss, log_loss

from armlab.common.arrays import Array
from armlab.common.statistics import wilson_interval
from armlab.diagnosis.naming.choice import Example, Numbers, fit_weights, probabilities

FOLDS = 5
BINS = (0.0, 0.5, 0.7, 0.9, 1.0)
# Stated before any finding: no number speaks for or against a name, and no effect is likelier than another one. How far
# a weight may be from that, a standard deviation: an effect twice as likely as another one is usual (log 2 = 0.7).
# How many effects stand at a joint, and whether something is left at others, is how a set was drawn: a real arm has
# several of each, so little may be learnt of that.
EFFECT_PREFIX, EFFECT_SPREAD, SPREAD = "is ", 0.7, 2.0
COMPANY, COMPANY_SPREAD = ("found beside", "found crowd", "found structure elsewhere", "structure beside"), 0.3
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Finding:
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

    left_out: the weights without each real recording.
    """

    weights: dict[str, float]
    left_out: dict[str, dict[str, float]]
    findings: int
    tiers: dict[str, Reliability]


def calibrate(findings: Sequence[Finding]) -> Calibration:
    """The weights of everything that speaks for a name, and their reliability."""
    recordings = sorted({each.recording for each in findings if each.recording})
    left_out = {name: weights_of([each.example for each in findings if each.recording != name]) for name in recordings}
    chances, tiers = left_out_probabilities(findings, left_out), {}
    for tier in sorted({each.tier for each in findings}):
        own = [at for at, each in enumerate(findings) if each.tier == tier and not each.background]
        if own:
            tiers[tier] = judge_reliability([chances[at] for at in own], [findings[at].example.right for at in own])
    return Calibration(weights_of([each.example for each in findings]), left_out, len(findings), tiers)


def weights_of(examples: Sequence[Example]) -> dict[str, float]:
    """The likeliest weights near those that were stated before."""
    keys = sorted({key for each in examples for name in each.names for key in name})
    return fit_weights(examples, dict.fromkeys(keys, 0.0), {key: stated_spread(key) for key in keys})


def stated_spread(key: str) -> float:
    """How far a weight may be from zero, a standard deviation."""
    if key in COMPANY:
        return COMPANY_SPREAD
    return EFFECT_SPREAD if key.startswith(EFFECT_PREFIX) else SPREAD


def left_out_probabilities(findings: Sequence[Finding], known: Mapping[str, Numbers]) -> list[Array]:
    """The probabilities of each finding by weights that were found without its case.

    known: the weights without each real recording.
    """
    cases = sorted({each.case for each in findings if not each.recording})
    folds = {case: number % FOLDS for number, case in enumerate(cases)}
    weights = [
        weights_of([each.example for each in findings if folds.get(each.case) != fold])
        for fold in range(FOLDS if cases else 0)
    ]
    return [
        probabilities(each.example.names, known[each.recording] if each.recording else weights[folds[each.case]])
        for each in findings
    ]


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
