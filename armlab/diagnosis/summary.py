"""The verdict in a paragraph that a person can read."""

from collections.abc import Sequence

from armlab.diagnosis.formats import Status
from armlab.diagnosis.result import Claim, JointFit
from armlab.effects.contract import UNKNOWN
from armlab.effects.library import effect_named

MAX_NAMED_FINDINGS = 6  # findings that the summary names; the others are counted


def summarise(status: Status, claims: Sequence[Claim], fits: Sequence[JointFit]) -> str:
    """What is missing and how much better the model then predicts."""
    if status == "none":
        worst = max((each.after for each in fits), default=0.0)
        return f"Nothing is missing: the simulation explains the recording down to its noise (at most {worst:.3g} N m)."
    findings = "; ".join(_describe_claim(claim) for claim in claims[:MAX_NAMED_FINDINGS])
    more = f"; and {len(claims) - MAX_NAMED_FINDINGS} more" if len(claims) > MAX_NAMED_FINDINGS else ""
    best = max(fits, key=lambda each: each.before - each.after)
    gain = f"On held-out data the error of joint {best.joint} falls from {best.before:.3g} to {best.after:.3g} N m."
    return f"The simulation misses {findings}{more}. {gain}"


def _describe_claim(claim: Claim) -> str:
    facts = effect_named(claim.effect)
    where = "" if claim.joint is None else f" at {'link' if facts.where == 'link' else 'joint'} {claim.joint}"
    if facts == UNKNOWN:
        return f"something unknown{where} that depends on {', '.join(claim.depends_on)}"
    rivals = " or ".join(dict.fromkeys(effect_named(each.effect).words for each in claim.rivals))
    return f"{facts.words}{where}{f' (or {rivals})' if rivals else ''}: {claim.equation}"
