"""Causes by the share of the error that they explain, and which of them lead."""

from collections.abc import Sequence
from dataclasses import dataclass

from armlab.diagnosis.result import Part

TOLD_SHARE = 0.95  # of the error: causes are told until they explain as much
MAX_TOLD_CAUSES = 4


@dataclass(frozen=True)
class ToldCause:
    """Findings with one cause. joints: from 1, none for the whole robot. findings: their places among the claims.

    share: of the error above the noise.
    """

    cause: str
    joints: tuple[int, ...]
    share: float
    findings: tuple[int, ...]


def causes_of(parts: Sequence[Part]) -> tuple[ToldCause, ...]:
    """The causes with findings, the one with the largest share first."""
    grouped: dict[str, list[Part]] = {}
    for part in parts:
        if part.claims:
            grouped.setdefault(part.cause, []).append(part)
    causes = [
        ToldCause(
            cause,
            tuple(sorted({part.joint for part in own if part.joint is not None})),
            float(sum(part.share for part in own)),
            tuple(sorted({number for part in own for number in part.claims})),
        )
        for cause, own in grouped.items()
    ]
    return tuple(sorted(causes, key=lambda each: -each.share))


def leading_causes(causes: Sequence[ToldCause]) -> tuple[ToldCause, ...]:
    """The largest causes, until they explain nearly all; what explains less than the rest that may stay open is none.

    The largest leads whatever it explains.
    """
    out, told = list[ToldCause](), 0.0
    for each in causes[:MAX_TOLD_CAUSES]:
        if out and (told >= TOLD_SHARE or each.share < 1 - TOLD_SHARE):
            break
        out.append(each)
        told += each.share
    return tuple(out)


def finding_shares(parts: Sequence[Part], findings: int) -> tuple[float, ...]:
    """The share of the error that each finding explains; those of a cause sum to its own."""
    shares = [0.0] * findings
    for part in parts:
        for number, share in zip(part.claims, part.shares, strict=True):
            shares[number] += share
    return tuple(shares)
