"""All that is said of a diagnosis: summary, page, terminal and files say it from this alone."""

from dataclasses import dataclass

import numpy as np

from armlab.diagnosis.result import Claim, Diagnosis, JointFriction
from armlab.diagnosis.torque.names.findings import (
    FRICTION,
    StatedCause,
    Statement,
    causes_of,
    finding_shares,
    leading_causes,
    minor_causes,
    statement_of,
    told_causes,
)
from armlab.effects.library import effect_named

MAX_USUAL_SHARE = 0.43  # of a joint's torque: nine of ten joints of results/real/folders_joints.csv, as plain least
# squares leaves them, leave less (one row a joint, those without a torque measurement left out)


@dataclass(frozen=True)
class Left:
    """joint: from 1. rms, noise: N m (N), held out. depends_on: variables. usual: whether real arms leave as much."""

    joint: int
    share_of_torque: float
    rms: float
    noise: float
    depends_on: tuple[str, ...]
    usual: bool


@dataclass(frozen=True, eq=False)
class StatedFinding:
    """A finding with how it is stated. number: its place among the claims, from 0. share: of the error above noise."""

    number: int
    claim: Claim
    statement: Statement
    share: float

    @property
    def cause(self) -> str:
        """See `armlab.diagnosis.torque.predict.parts.cause_of`."""
        return effect_named(self.claim.effect).cause

    @property
    def is_friction(self) -> bool:
        """Whether it is friction of a joint; friction behind play is."""
        candidate = self.claim.candidate
        return self.cause == FRICTION or (candidate is not None and candidate.is_friction)


@dataclass(frozen=True, eq=False)
class Account:
    """causes: the largest first. told: causes counted by those parts of which a finding is told; leading: those of them
    that the summary tells. groups: those that are told and, apart from them, what is minor of each cause, by size.
    findings: not minor, the largest share first; minor: the others. friction: of each joint with friction among the
    findings. left: of each joint.
    """

    causes: tuple[StatedCause, ...] = ()
    told: tuple[StatedCause, ...] = ()
    leading: tuple[StatedCause, ...] = ()
    groups: tuple[StatedCause, ...] = ()
    findings: tuple[StatedFinding, ...] = ()
    minor: tuple[StatedFinding, ...] = ()
    friction: tuple[JointFriction, ...] = ()
    left: tuple[Left, ...] = ()

    def findings_of(self, cause: StatedCause) -> tuple[StatedFinding, ...]:
        """Those of a cause that are not minor."""
        return tuple(each for each in self.findings if each.number in cause.findings)

    def friction_of(self, joint: int) -> JointFriction | None:
        """The friction of a joint, from 1, where some was found."""
        return next((each for each in self.friction if each.joint == joint), None)


def account_of(diagnosis: Diagnosis) -> Account:
    """What is said of a diagnosis."""
    claims, parts = diagnosis.claims, diagnosis.parts
    shares = finding_shares(parts, len(claims))
    every = [
        StatedFinding(number, claim, statement_of(claim), share)
        for number, (claim, share) in enumerate(zip(claims, shares, strict=True))
    ]
    every.sort(key=lambda each: -each.share)
    told = told_causes(parts, claims)
    rubbing = {each.claim.joint for each in every if each.is_friction}
    return Account(
        causes=causes_of(parts),
        told=told,
        leading=leading_causes(told),
        groups=tuple(sorted((*told, *minor_causes(parts, claims)), key=lambda each: -each.share)),
        findings=tuple(each for each in every if not each.claim.minor),
        minor=tuple(each for each in every if each.claim.minor),
        friction=tuple(each for each in diagnosis.friction if each.joint in rubbing),
        left=left_by_joint(diagnosis),
    )


def left_by_joint(diagnosis: Diagnosis) -> tuple[Left, ...]:
    """One entry a joint; none where nothing was fitted."""
    observed = diagnosis.observed
    if observed is None:
        return ()
    known = {each.joint: each.depends_on for each in diagnosis.unexplained}
    out = []
    for fit in diagnosis.fit:
        rows = observed.rows_held_out(fit.joint - 1)
        torque = float(np.sqrt(np.mean(observed.torque[rows, fit.joint - 1] ** 2)))
        share = fit.after / max(torque, 1e-300)
        out.append(
            Left(fit.joint, share, fit.after, fit.noise_floor, known.get(fit.joint, ()), share <= MAX_USUAL_SHARE)
        )
    return tuple(out)


def finding_errors(claim: Claim) -> tuple[float, float]:
    """Held-out error, N m (N), without a finding and with it, at the joint that misses it most.

    With it: of the model found; without it the rest is fitted anew. A finding without a name is in no model: there its
    own test tells the errors.
    """
    if claim.removal is None:
        return claim.evidence.rms_before, claim.evidence.rms_after
    return (1 + claim.removal.growth) * claim.removal.rms, claim.removal.rms
