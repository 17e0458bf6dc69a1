"""From a pruned model to claims: names, numbers, equations and rivals."""

from dataclasses import replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.evidence import Evidence
from armlab.diagnosis.fitted_model import FittedModel
from armlab.diagnosis.intervals import ShapedFit, extend_with_shapes, parameter_half_widths
from armlab.diagnosis.links import Widths
from armlab.diagnosis.result import Claim, Interval, Parameter, Rival
from armlab.diagnosis.search import Search
from armlab.diagnosis.solver import State
from armlab.effects.contract import Candidate
from armlab.effects.links import InertialError, Payload, felt_values
from armlab.effects.naming import IDENTICAL_EFFECTS
from armlab.effects.next_experiment import next_experiment
from armlab.effects.springs import SpringCompensator
from armlab.effects.term import SIGN_SIGMAS
from problem.motion import Motion
from problem.pseudo_inertia import pseudo_inertia_basis
from problem.regressor import rigid_body_torque

MAX_DEFICIT = 2.0  # units of log likelihood: a difference that may be chance
HELD_OUT_TOLERANCE = 0.01  # of the held-out error
MAX_RIVALS = 3

RivalRows = list[tuple[str, int | None, tuple[int, ...], bool, float]]


def find_rivals(found: FittedModel, group: int, own: Candidate) -> RivalRows:
    """Rivals of a group in the state of a round: effect, joint, joints, identical, deficit; the best first.

    own: the candidate under its first name.
    """
    solver, state = found.solver, found.state
    out: RivalRows = [
        (name, own.joint, own.joints, True, 0.0) for name in IDENTICAL_EFFECTS.get((own.effect, own.form), ())
    ]
    search = Search(solver, found.bench.settings.guards, True, 0)
    without = state.minus(group)
    scores = search.gains(without)
    full = found.moments.heldout_error(found.fit.coefficients)
    for number in np.argsort(-scores):
        rival = int(number)
        deficit = float(scores[group] - scores[rival])
        if deficit > MAX_DEFICIT or len(out) >= MAX_RIVALS:
            break
        candidate = solver.groups[rival].candidate
        same = candidate.effect == own.effect and candidate.joint == own.joint
        known = any(each[:2] == (candidate.effect, candidate.joint) for each in out)
        if same or known or search.excluded(without, rival):
            continue
        other = search.with_group(without, rival)
        if search.objection(other, rival) is None and _predicts_as_well(found, other, full):
            out.append((candidate.effect, candidate.joint, candidate.joints, False, max(deficit, 0.0)))
    return out


def _predicts_as_well(found: FittedModel, other: State, full: Array) -> bool:
    error = found.moments.heldout_error(found.solver.fit(other).coefficients)
    return bool(np.all(error <= (1 + HELD_OUT_TOLERANCE) * full))


BY_DIRECTION = {"coulomb_friction", "torque_offset"}
CONSTANT = {"torque_offset", "cable_stiffness"}
COMPENSATOR_SHARE = 0.5  # of the scatter of the joint's gravity torque
BODY_SIZE_M = 0.1  # m: the size of a body
EIGENVALUE_TOLERANCE = (
    0.1  # of the largest eigenvalue: a point has no spread, and what is fitted to it may have a little less
)
OUTLYING_FACTOR = 4.0  # times the median width of the other links


def make_claims(found: FittedModel, effects: dict[int, Evidence], links: dict[int, Evidence]) -> tuple[Claim, ...]:
    """All claims of a round, the strongest first."""
    if not effects and not links:
        return ()
    wide = extend_with_shapes(found)
    claims = [_effect_claim(found, wide, group, evidence) for group, evidence in effects.items()]
    claims += _link_claims(found, wide, links)
    claims = [_with_direction_rival(claim, claims) for claim in claims]
    return tuple(sorted(claims, key=lambda claim: -claim.evidence.score))


def _with_direction_rival(claim: Claim, claims: list[Claim]) -> Claim:
    """Coulomb friction beside an offset or the rest of a spring is two levels that differ by direction, exactly."""
    here = {other.effect for other in claims if other.joint == claim.joint}
    if claim.effect not in BY_DIRECTION or "coulomb_friction" not in here or not here & CONSTANT:
        return claim
    rival = Rival("asymmetric_friction", claim.joint, claim.joints, True)
    rivals = (rival, *(each for each in claim.rivals if each.effect != rival.effect))
    names = tuple(each.effect for each in rivals)
    return replace(claim, rivals=rivals[:MAX_RIVALS], next_experiment=next_experiment(claim.effect, names))


def _effect_claim(found: FittedModel, wide: ShapedFit, group: int, evidence: Evidence) -> Claim:
    solver = found.solver
    candidate, columns = solver.groups[group].candidate, solver.groups[group].columns
    candidate = _prefer_compensator(found, candidate, group)
    coefficients, covariance = solver.values(found.fit, group), wide.covariance(group)
    parameters = named_parameters(candidate, coefficients, covariance, wide.factor)
    own = np.zeros(found.moments.size)
    own[columns] = coefficients
    rivals = tuple(Rival(*each) for each in find_rivals(found, group, candidate))
    return Claim(
        candidate.effect,
        candidate.joint,
        candidate.joints,
        parameters,
        candidate.equation(coefficients),
        evidence,
        found.columns.torque_of(own),
        rivals,
        next_experiment(candidate.effect, tuple(each.effect for each in rivals)),
        candidate,
        coefficients,
        covariance,
    )


def _prefer_compensator(found: FittedModel, candidate: Candidate, group: int) -> Candidate:
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
    carries = float(np.std(spring)) > COMPENSATOR_SHARE * float(np.std(weight)) and float(np.mean(spring * weight)) < 0
    return SpringCompensator.at(found.bench.simulation.arm, candidate.joint) if carries else candidate


def named_parameters(
    candidate: Candidate, coefficients: Array, covariance: Array, factor: float
) -> tuple[Parameter, ...]:
    """Named parameters with their intervals."""
    out = []
    for name, value, half in parameter_half_widths(candidate, coefficients, covariance, factor):
        interval: Interval | None = None
        if isinstance(value, tuple) and isinstance(half, tuple):
            interval = tuple((each - by, each + by) for each, by in zip(value, half, strict=True))
        elif isinstance(value, float) and isinstance(half, float):
            interval = (value - half, value + half)
        finite = interval is not None and bool(np.isfinite(np.array(interval)).all())
        out.append(Parameter(name, value, interval if finite else None, candidate.unit(name)))
    return tuple(out)


def _link_claims(found: FittedModel, wide: ShapedFit, links: dict[int, Evidence]) -> list[Claim]:
    """One claim for each link that is off: its ten parameters, given what the joints feel of all links."""
    bench, widths = found.bench, found.fit.state.widths
    if not links or bench.prior is None or widths is None:
        return []
    base, covariance = wide.base()
    mean, spread = bench.prior.deviations(widths, base, covariance)
    return [_link_claim(found, wide.factor, link, (mean, spread), evidence) for link, evidence in links.items()]


def _link_claim(
    found: FittedModel, factor: float, link: int, deviations: tuple[Array, Array], evidence: Evidence
) -> Claim:
    """The claim about one link (from 0); deviations: mean and covariance of all links' parameters."""
    bench, (mean, spread) = found.bench, deviations
    place, widths = slice(10 * link, 10 * link + 10), found.fit.state.widths or ()
    turn = np.column_stack([felt_values(bench.simulation.arm, link + 1, unit) for unit in np.eye(10)])
    coefficients, covariance = turn @ mean[place], turn @ spread[place, place] @ turn.T
    last = link + 1 == len(bench.simulation.arm)
    body = _may_be_body(mean[place], spread[place, place])
    carried = last and body and is_outlying(widths, link)
    kind = Payload if carried else InertialError
    candidate: Candidate = kind.at(bench.simulation.arm, link + 1)
    change, torque = np.zeros(len(mean)), np.zeros(found.moments.size)
    change[place] = mean[place]
    torque[: len(bench.base)] = bench.base.grouping @ change
    other = Rival("inertial_parameter_error" if carried else "payload", link + 1, (), True)
    rivals = (other,) if body else ()
    return Claim(
        candidate.effect,
        link + 1,
        (),
        named_parameters(candidate, coefficients, covariance, factor),
        candidate.equation(coefficients),
        evidence,
        found.columns.torque_of(torque),
        rivals,
        next_experiment(candidate.effect, tuple(each.effect for each in rivals)),
        candidate,
        coefficients,
        covariance,
        in_links=True,
    )


def is_outlying(widths: Widths, link: int) -> bool:
    """Whether a link is off far more than the others: something was added to it."""
    others = [width for other, width in enumerate(widths) if other != link]
    return not others or widths[link] >= OUTLYING_FACTOR * float(np.median(others))


def _may_be_body(ten: Array, covariance: Array) -> bool:
    """Whether what a link has more than its simulation could be a body: mass, and a positive semidefinite inertia."""
    scale = np.array(
        [1 / BODY_SIZE_M, 1 / BODY_SIZE_M, 1 / BODY_SIZE_M, 1.0]
    )  # so that all of the pseudo-inertia is in kilograms
    parts = pseudo_inertia_basis() * np.outer(scale, scale)
    values, vectors = np.linalg.eigh(np.einsum("p,pab->ab", ten, parts))
    slopes = np.einsum("a,pab,b->p", vectors[:, 0], parts, vectors[:, 0])
    doubt = 1.5 * SIGN_SIGMAS * np.sqrt(max(float(slopes @ covariance @ slopes), 0.0)) + EIGENVALUE_TOLERANCE * float(
        np.abs(values).max()
    )
    return bool(ten[0] > 0 and values[0] + doubt >= 0)
