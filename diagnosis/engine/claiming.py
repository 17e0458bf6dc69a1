"""From a pruned round to claims with names, numbers, equations and rivals."""

from dataclasses import replace

import numpy as np

from diagnosis.effects.compensator import SpringCompensator
from diagnosis.effects.contract import Candidate
from diagnosis.effects.inertial_error import InertialError
from diagnosis.effects.link_columns import felt_values
from diagnosis.effects.payload import Payload
from diagnosis.effects.term import CERTAIN
from diagnosis.engine.evidence import Evidence
from diagnosis.engine.intervals import Extended, extended, named
from diagnosis.engine.links import Widths
from diagnosis.engine.rivals import MOST, rivals_of
from diagnosis.engine.rounds import Round
from diagnosis.next_experiment import next_experiment
from diagnosis.result import Claim, Interval, Parameter, Rival
from identification.pseudo_inertia import basis
from problem.motion import Motion
from problem.regressor import rigid_body_torque
from recordings.run import Array

BY_DIRECTION = {"coulomb_friction", "torque_offset"}
CONSTANT = {"torque_offset", "cable_stiffness"}
CARRIES = 0.5  # of the scatter of the joint's gravity torque
REACH = 0.1  # m: the size of a body
HARDLY = 0.1  # of the largest eigenvalue: a point has no spread, and what is fitted to it may have a little less
OUTLYING = 4.0  # times the median width of the other links


def claims_of(found: Round, effects: dict[int, Evidence], links: dict[int, Evidence]) -> tuple[Claim, ...]:
    """All claims of a round, the strongest first."""
    if not effects and not links:
        return ()
    wide = extended(found)
    claims = [_effect(found, wide, group, evidence) for group, evidence in effects.items()]
    claims += _links(found, wide, links)
    claims = [_by_direction(claim, claims) for claim in claims]
    return tuple(sorted(claims, key=lambda claim: -claim.evidence.score))


def _by_direction(claim: Claim, claims: list[Claim]) -> Claim:
    """Coulomb friction beside an offset or the rest of a spring is two levels that differ by direction, exactly."""
    here = {other.effect for other in claims if other.joint == claim.joint}
    if claim.effect not in BY_DIRECTION or "coulomb_friction" not in here or not here & CONSTANT:
        return claim
    rival = Rival("asymmetric_friction", claim.joint, claim.joints, True)
    rivals = (rival, *(each for each in claim.rivals if each.effect != rival.effect))
    names = tuple(each.effect for each in rivals)
    return replace(claim, rivals=rivals[:MOST], next_experiment=next_experiment(claim.effect, names))


def _effect(found: Round, wide: Extended, group: int, evidence: Evidence) -> Claim:
    solver = found.solver
    candidate, columns = solver.groups[group].candidate, solver.groups[group].columns
    candidate = _named(found, candidate, group)
    coefficients, covariance = solver.values(found.fit, group), wide.covariance(group)
    parameters = parameters_of(candidate, coefficients, covariance, wide.factor)
    own = np.zeros(found.moments.size)
    own[columns] = coefficients
    rivals = tuple(Rival(*each) for each in rivals_of(found, group, candidate))
    return Claim(
        candidate.effect, candidate.joint, candidate.joints, parameters,
        candidate.equation(coefficients), evidence, found.columns.explained(own), rivals,
        next_experiment(candidate.effect, tuple(each.effect for each in rivals)), candidate, coefficients, covariance,
    )  # fmt: skip


def _named(found: Round, candidate: Candidate, group: int) -> Candidate:
    """A linear spring that carries a good part of gravity is a compensator: no cable does."""
    if (candidate.effect, candidate.form) != ("cable_stiffness", "linear") or candidate.joint is None:
        return candidate
    values, joint = found.solver.values(found.fit, group), candidate.joint - 1
    springs, gravity = [], []
    for scene in found.bench.scenes:
        still = Motion(scene.motion.position, *(np.zeros_like(scene.motion.position),) * 2)
        springs.append(candidate.columns(scene)[:, 0] @ values)
        gravity.append(rigid_body_torque(scene.arm, still, scene.inertial)[:, joint])
    spring, weight = np.concatenate(springs), np.concatenate(gravity)
    carries = float(np.std(spring)) > CARRIES * float(np.std(weight)) and float(np.mean(spring * weight)) < 0
    return SpringCompensator.at(found.bench.simulation.arm, candidate.joint) if carries else candidate


def parameters_of(candidate: Candidate, coefficients: Array, covariance: Array, factor: float) -> tuple[Parameter, ...]:
    """Named parameters with their intervals."""
    out = []
    for name, value, half in named(candidate, coefficients, covariance, factor):
        interval: Interval | None = None
        if isinstance(value, tuple) and isinstance(half, tuple):
            interval = tuple((each - by, each + by) for each, by in zip(value, half, strict=True))
        elif isinstance(value, float) and isinstance(half, float):
            interval = (value - half, value + half)
        finite = interval is not None and bool(np.isfinite(np.array(interval)).all())
        out.append(Parameter(name, value, interval if finite else None, candidate.unit(name)))
    return tuple(out)


def _links(found: Round, wide: Extended, links: dict[int, Evidence]) -> list[Claim]:
    """One claim for each link that is off: its ten parameters, given what the joints feel of all links."""
    bench, widths = found.bench, found.fit.state.widths
    if not links or bench.prior is None or widths is None:
        return []
    base, covariance = wide.base()
    mean, spread = bench.prior.deviations(widths, base, covariance)
    return [_link(found, wide.factor, link, (mean, spread), evidence) for link, evidence in links.items()]


def _link(found: Round, factor: float, link: int, deviations: tuple[Array, Array], evidence: Evidence) -> Claim:
    """The claim about one link (from 0); deviations: mean and covariance of all links' parameters."""
    bench, (mean, spread) = found.bench, deviations
    place, widths = slice(10 * link, 10 * link + 10), found.fit.state.widths or ()
    turn = np.column_stack([felt_values(bench.simulation.arm, link + 1, unit) for unit in np.eye(10)])
    coefficients, covariance = turn @ mean[place], turn @ spread[place, place] @ turn.T
    last = link + 1 == len(bench.simulation.arm)
    body = _could_be_a_body(mean[place], spread[place, place])
    carried = last and body and outlying(widths, link)
    kind = Payload if carried else InertialError
    candidate: Candidate = kind.at(bench.simulation.arm, link + 1)
    change, torque = np.zeros(len(mean)), np.zeros(found.moments.size)
    change[place] = mean[place]
    torque[: len(bench.base)] = bench.base.grouping @ change
    other = Rival("inertial_parameter_error" if carried else "payload", link + 1, (), True)
    rivals = (other,) if body else ()
    return Claim(
        candidate.effect, link + 1, (), parameters_of(candidate, coefficients, covariance, factor),
        candidate.equation(coefficients), evidence, found.columns.explained(torque), rivals,
        next_experiment(candidate.effect, tuple(each.effect for each in rivals)), candidate, coefficients, covariance,
        in_links=True,
    )  # fmt: skip


def outlying(widths: Widths, link: int) -> bool:
    """Whether a link is off far more than the others: something was added to it."""
    others = [width for other, width in enumerate(widths) if other != link]
    return not others or widths[link] >= OUTLYING * float(np.median(others))


def _could_be_a_body(ten: Array, covariance: Array) -> bool:
    """Whether what a link has more than its simulation could be a body: mass, and a positive semidefinite inertia."""
    scale = np.array([1 / REACH, 1 / REACH, 1 / REACH, 1.0])  # so that all of the pseudo-inertia is in kilograms
    parts = basis() * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(np.einsum("p,pab->ab", ten, parts))
    slopes = np.einsum("a,pab,b->p", vectors[:, 0], parts, vectors[:, 0])
    doubt = 1.5 * CERTAIN * np.sqrt(max(float(slopes @ covariance @ slopes), 0.0)) + HARDLY * float(
        np.abs(values).max()
    )
    return bool(ten[0] > 0 and values[0] + doubt >= 0)
