"""One rigid body added to one link: where these data can place it, fitted among bodies that can exist.

The ten parameters of a body have a positive semidefinite pseudo-inertia (Wensing, Kim and Slotine 2018). Data that
excite few of its directions leave the others to that constraint: without it a body at a wrong link, of negative mass or
of impossible spread, fits what belongs to its neighbour. Everything else of the model is fitted beside the body.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.diagnosis.torque.belief import Belief
from armlab.diagnosis.torque.columns.links import Widths
from armlab.diagnosis.torque.columns.solver import Solver, State
from armlab.diagnosis.torque.predict.prediction import Prediction
from armlab.diagnosis.torque.search.fitted_model import FittedModel, inertial_parameters
from armlab.diagnosis.torque.search.search import FailedTest, Step
from armlab.effects.links import (
    BODY_SIZE_M,
    EIGENVALUE_TOLERANCE,
    PAYLOAD_FACTS,
    Payload,
    SolidBody,
    felt_by_ten,
    pseudo_inertia_parts,
)
from problem.pseudo_inertia import pseudo_inertias

BALL_MASS = 10.0  # kg, where the search for a body begins
MAX_NEWTON_STEPS, MIN_STEP_SHARE = 100, 1e-9
SUFFICIENT_SHARE = 0.1  # of what a step should gain, for it to be taken
NEWTON_TOLERANCE, PATH_TOLERANCE = 1e-3, 0.1  # of the log likelihood
PATH_FACTOR = 30.0  # by which the data weigh more at each stage of the path
MIN_CURVATURE = 1e-9  # less is no maximum
BODY_CHANGE = 0.01  # of a body's ten parameters: less does not change what is beside it
KILOGRAMS = np.array([1.0, *[1 / BODY_SIZE_M] * 3, *[1 / BODY_SIZE_M**2] * 6])  # of ten parameters
MAX_PROJECTIONS = 2000
LEAST_SPREAD = 1e-6  # of a body's largest eigenvalue, so that projections end among bodies and not at their edge
EIGENVALUE_SHARE = 0.02  # of a pseudo-inertia's largest eigenvalue: a point has no spread, and a little less is noise


@dataclass(frozen=True, eq=False)
class PlacedBody:
    """A body at a link, and the fit of the model with it.

    group: of the payload at this link. ten: (10,) about the link's frame. coefficients: (size,), scaled. gain: half the
    chi-square that it adds. error: (joints,) what held-out rows leave.
    """

    group: int
    link: int
    ten: Array
    coefficients: Array
    gain: float
    error: Array


def body_groups(solver: Solver) -> dict[int, int]:
    """The group of a payload of ten parameters, by link: where an arm can weigh the link."""
    return {
        group.candidate.joints[0]: number
        for number, group in enumerate(solver.groups)
        if isinstance(group.candidate, Payload)
    }


def payload_groups(model: FittedModel) -> tuple[int, ...]:
    """The groups of a state that add a body to a link."""
    groups = model.solver.groups
    return tuple(each for each in model.state.groups if groups[each].candidate.effect == PAYLOAD_FACTS.id)


def place_body(model: FittedModel, without: State) -> tuple[PlacedBody, ...]:
    """One body at each link that an arm can weigh, beside the other groups of a state; the best first."""
    placed = [fit_body(model, without, group, link) for link, group in body_groups(model.solver).items()]
    return tuple(sorted(placed, key=lambda each: -each.gain))


def fit_body(model: FittedModel, without: State, group: int, link: int) -> PlacedBody:
    """The likeliest body that can exist at a link, everything else fitted beside it.

    With the other parameters eliminated, half the chi-square is -x'Hx/2 + g'x of the ten parameters x.
    """
    solver = model.solver
    columns, gram = solver.groups[group].columns, model.moments.gram
    scaled = model.moments.lengths[columns][:, None] * felt_by_ten(model.design.simulation.arm, link)
    fit, own_and_torque = solver.free_fit(without), np.append(columns, -1)
    products = solver.products(without, own_and_torque)
    solved = fit.inverse @ products
    rest = gram[np.ix_(columns, columns)] - products[:, :-1].T @ solved[:, :-1]
    towards = gram[columns, -1] - products[:, :-1].T @ solved[:, -1]
    ten, gain = _likeliest_body(scaled.T @ rest @ scaled, scaled.T @ towards)
    own = scaled @ ten
    coefficients = np.zeros(model.moments.size)
    others, rank = solved[:, -1] - solved[:, :-1] @ own, fit.links.shape[1]
    coefficients[: solver.base] = fit.links @ others[:rank]
    coefficients[fit.columns] = others[rank:]
    coefficients[columns] = own
    return PlacedBody(group, link, ten, coefficients, gain, model.moments.heldout_error(coefficients))


def _likeliest_body(hessian: Array, slope: Array) -> tuple[Array, float]:
    """The ten parameters x of the body that maximises slope'x - x'Hx/2 + log det P(x) - 4 log tr P(x).

    Also that maximum without the last two terms. P is the pseudo-inertia in kilograms: its determinant keeps a body
    possible (Lee, Wensing and Park 2020), its trace keeps it small where data do not tell. Both together are the same
    for any mass. The way there is a path of convex problems, in which the data weigh more and more beside a ball
    (Boyd and Vandenberghe 2004, ch. 11): Newton's method straight from a ball stalls at bodies that hardly exist.
    """
    body = BALL_MASS * np.eye(4)
    weight = 1 / max(_uphill(_NearBall(hessian, slope, 1.0), body)[1], 1.0)
    while weight < 1:
        body = _climb(_NearBall(hessian, slope, weight), body, PATH_TOLERANCE)
        weight *= PATH_FACTOR
    body = _climb(_NearBall(hessian, slope, 1.0), body, PATH_TOLERANCE)
    ten = _ten_of(_climb(_Chance(hessian, slope, 1.0), body, NEWTON_TOLERANCE))
    return ten, float(slope @ ten - ten @ hessian @ ten / 2)


@dataclass(frozen=True, eq=False)
class _Chance:
    """weight (slope'x - x'Hx/2) + log det P(x) - 4 log tr P(x) of a body with pseudo-inertia P."""

    hessian: Array
    slope: Array
    weight: float

    def size(self, trace: float) -> tuple[float, float, float]:
        """What a trace costs, and its first and second derivative."""
        return 4 * float(np.log(trace)), 4 / trace, -4 / trace**2

    def at(self, body: Array) -> float:
        """No chance where there is no such body. body: (4, 4)."""
        values = np.linalg.eigvalsh(body)
        if values[0] <= 0:
            return -np.inf
        ten = _ten_of(body)
        data = self.slope @ ten - ten @ self.hessian @ ten / 2
        return float(self.weight * data + np.sum(np.log(values)) - self.size(float(np.sum(values)))[0])


class _NearBall(_Chance):
    """The same with tr P / `BALL_MASS` in the place of its logarithm: convex, and a ball where data weigh nothing."""

    def size(self, trace: float) -> tuple[float, float, float]:
        return trace / BALL_MASS, 1 / BALL_MASS, 0.0


def _climb(chance: _Chance, body: Array, tolerance: float) -> Array:
    """Newton's method from a body, with steps that stay among bodies. tolerance: of the log likelihood."""
    for _ in range(MAX_NEWTON_STEPS):
        step, gain = _uphill(chance, body)
        if gain < tolerance:
            break
        now, share = chance.at(body), 1.0
        while share > MIN_STEP_SHARE and not chance.at(body + share * step) > now + SUFFICIENT_SHARE * share * gain:
            share /= 2
        if share <= MIN_STEP_SHARE:
            break
        body = body + share * step
    return body


def _uphill(chance: _Chance, body: Array) -> tuple[Array, float]:
    """Newton's step from a body, (4, 4), and twice what it should gain.

    In coordinates in which the body is a unit ball the determinant's curvature is the identity, however thin it is.
    """
    root = np.linalg.cholesky(body)
    moves = root @ SYMMETRIC_BASIS @ root.T
    slopes = _ten_of(moves).T
    traces = np.trace(moves, axis1=1, axis2=2)
    _, cost, bend = chance.size(float(np.trace(body)))
    data = slopes.T @ (chance.slope - chance.hessian @ _ten_of(body))
    uphill = chance.weight * data + np.trace(SYMMETRIC_BASIS, axis1=1, axis2=2) - cost * traces
    curvature = chance.weight * slopes.T @ chance.hessian @ slopes + np.eye(10)
    whole = curvature + bend * np.outer(traces, traces)
    if np.linalg.eigvalsh(whole)[0] > MIN_CURVATURE:
        curvature = whole
    step = np.linalg.solve(curvature, uphill)
    return np.asarray(np.einsum("k,kab->ab", step, moves)), float(uphill @ step)


def _symmetric_basis() -> Array:
    """Orthonormal symmetric matrices, (10, 4, 4)."""
    out = []
    for row, column in zip(*np.triu_indices(4), strict=True):
        one = np.zeros((4, 4))
        one[row, column] = one[column, row] = 1.0 if row == column else np.sqrt(0.5)
        out.append(one)
    return np.array(out)


SYMMETRIC_BASIS, TEN_OF_BODY = _symmetric_basis(), np.linalg.pinv(pseudo_inertia_parts().reshape(10, 16))


def _ten_of(bodies: Array) -> Array:
    """The ten parameters of pseudo-inertias in kilograms, (..., 4, 4) to (..., 10)."""
    return np.asarray(bodies.reshape(*bodies.shape[:-2], 16) @ TEN_OF_BODY)


def is_possible_body(ten: Array, tolerance: float = EIGENVALUE_SHARE) -> bool:
    """Whether ten parameters are those of a body; tolerance: of the largest eigenvalue, in kilograms."""
    values = np.linalg.eigvalsh(pseudo_inertias(ten * KILOGRAMS)[0])
    return bool(ten[0] > 0 and values[0] >= -tolerance * float(values[-1]))


def possible_links(belief: Belief) -> Belief:
    """The links (from 0) that are bodies as they were found, what they are off included; the log says of the others."""
    links = belief.links
    if not links or not belief.model.design.settings.guards.physics_signs:
        return belief
    found = _split_among_bodies(belief.model)
    kept = {link: each for link, each in links.items() if is_possible_body(found[link], EIGENVALUE_TOLERANCE)}
    why = "no body has the mass, centre and inertia that these data give it"
    failed = FailedTest("bodies that can exist", why)
    gone = tuple(Step(f"withdrawn: link {link + 1}: {why}", 0.0, failed) for link in links if link not in kept)
    return replace(belief.with_steps(*gone), links=kept)


def _split_among_bodies(model: FittedModel) -> Array:
    """Parameters of all links, (joints, 10): bodies, as far as the joints feel the same torque of them.

    Joints feel sums of links' parameters alone. How a sum that is found is split among the links that are off is the
    prior's guess, and may be no body where another split is one: found by projections on bodies and on what feels the
    same, in turn.
    """
    found, prior = inertial_parameters(model).reshape(-1, 10), model.design.prior
    off = np.array([bool(width) for width in model.state.widths or (0.0,) * len(found)])
    if prior is None or not off.any():
        return found
    units = np.tile(KILOGRAMS, int(off.sum()))
    felt = prior.grouping.reshape(len(prior.grouping), -1, 10)[:, off].reshape(len(prior.grouping), -1) / units
    unfelt = np.eye(len(units)) - np.linalg.pinv(felt) @ felt
    start = found[off].ravel() * units
    split = start
    for _ in range(MAX_PROJECTIONS):
        if all(is_possible_body(each, 0.0) for each in (split / units).reshape(-1, 10)):
            break
        split = start + unfelt @ (_nearest_bodies(split.reshape(-1, 10)).ravel() - start)
    found[off] = (split / units).reshape(-1, 10)
    return found


def _nearest_bodies(tens: Array) -> Array:
    """The bodies nearest to parameters in kilograms, (bodies, 10), with a little spread in every direction."""
    values, vectors = np.linalg.eigh(pseudo_inertias(tens.ravel()))
    raised = np.maximum(values, LEAST_SPREAD * values[:, -1:])
    return np.asarray(_ten_of((vectors * raised[:, None, :]) @ vectors.transpose(0, 2, 1)) * KILOGRAMS)


def predicts_as_well(error: Array, other: Array, tolerance: float) -> bool:
    """Whether held-out rows leave no more than another model does, (joints,), in the mean of the joints' logarithms."""
    ratio = np.log(np.maximum(error, 1e-300)) - np.log(np.maximum(other, 1e-300))
    return bool(np.mean(ratio) <= 2 * np.log1p(tolerance))


@dataclass(frozen=True, eq=False)
class BodyTrial:
    """A body in the place of what a model has of bodies: beside which state, and the score of the model with it."""

    body: PlacedBody
    without: State
    score: float


def hold_body(model: FittedModel) -> FittedModel:
    """The model with one body that can exist in the place of added bodies, or of links that are off.

    Where no added body of the model is impossible, it takes their place if it explains as much and predicts held-out
    rows as well. Its form is held, so that it stays a body whatever else the model has. The same model where nothing
    changes.
    """
    if model.design.prior is None or not model.design.settings.guards.physics_signs:
        return model
    present, widths = payload_groups(model), model.state.widths or ()
    groups, held = model.solver.groups, set(_held_groups(model))
    point = len(present) == 1 and len(groups[present[0]].columns) == 1 and not held & set(present)
    if not any(widths) and (point or not present):
        return model
    trials = [each for each in _trials(model, present) if not _is_one_link(model, each)]
    if all(_is_possible(model, group) for group in present):
        trials = [each for each in trials if _stands_in(model, each)]
    best = max(trials, key=lambda each: each.score, default=None)
    return model if best is None or _has_body(model, best) else _with_held_body(model, best, present)


def find_body_anew(model: FittedModel) -> FittedModel:
    """The model with its held body as it is beside what the model has now; the same model where it has none."""
    return hold_body(model) if holds_body(model) else model


def holds_body(model: FittedModel) -> bool:
    """Whether a model has a body of held form."""
    return bool(set(_held_groups(model)) & set(model.state.groups))


def mass_found_anew(model: FittedModel, link: int) -> float | None:
    """The mass of a held body, kg, where it is found anew beside all that the model has; None without one at a link."""
    held = next((each for each in _held_groups(model) if each in model.state.groups), None)
    if held is None or _link(model, held) != link:
        return None
    return float(fit_body(model, model.state.minus(held), body_groups(model.solver)[link], link).ten[0])


def _trials(model: FittedModel, present: Sequence[int]) -> list[BodyTrial]:
    """A body at each link in the place of the present ones, with links as far off as they are, or fewer of them.

    A body beside all links that are off is in the place of nothing where none is present. Where ten parameters that are
    no body predict held-out rows better, a link is off and carries nothing.
    """
    rest, widths = tuple(each for each in model.state.groups if each not in present), model.state.widths
    solver, out = model.solver, []
    if not body_groups(solver):
        return []
    for tried in _fewer_off(widths) + ([widths] if present else []):
        without = State(rest, tried)
        crowd = solver.tuning.crowd_penalty * solver.crowd(without.groups)
        free = max(
            (solver.fit(without.plus(group)) for group in body_groups(solver).values()), key=lambda fit: fit.score
        )
        error, tolerance = (
            model.moments.heldout_error(free.coefficients),
            model.design.settings.tuning.claims.body_tolerance,
        )
        for body in place_body(model, without):
            score = solver.fit(without).score + body.gain - float(solver.prices[body.group]) - crowd
            if body.gain > 0 and predicts_as_well(body.error, error, tolerance):
                out.append(BodyTrial(body, without, score))
    return out


def _fewer_off(widths: Widths | None) -> list[Widths | None]:
    """Widths of links of which one that is off, or all, are as simulated."""
    off = [link for link, width in enumerate(widths or ()) if width]
    fewer = [tuple(0.0 if other == link else each for other, each in enumerate(widths or ())) for link in off]
    return list(dict.fromkeys([*fewer, (0.0,) * len(widths or ())])) if off else []


def _is_one_link(model: FittedModel, trial: BodyTrial) -> bool:
    """Whether one link that is off, and is no body, is likelier than a body beside links that are off."""
    solver, widths = model.solver, trial.without.widths or ()
    if not any(widths):
        return False
    alone = State(trial.without.groups, (0.0,) * len(widths))
    likeliest = max(solver.fit(alone.plus(group)).score for group in body_groups(solver).values())
    return likeliest - trial.score > model.design.settings.tuning.claims.max_deficit


def _stands_in(model: FittedModel, trial: BodyTrial) -> bool:
    """Whether a model with a body explains as much as the model does, and predicts as well."""
    tuning = model.design.settings.tuning.claims
    error = model.moments.heldout_error(model.fit.coefficients)
    as_likely = model.fit.score - trial.score <= tuning.max_deficit
    return as_likely and predicts_as_well(trial.body.error, error, tuning.body_tolerance)


def _is_possible(model: FittedModel, group: int) -> bool:
    ten = model.candidate(group).added_body(model.solver.values(model.fit, group))
    return ten is not None and is_possible_body(ten)


def _held_groups(model: FittedModel) -> tuple[int, ...]:
    """The group of the body whose form is held, in the model or not."""
    return tuple(number for number, each in enumerate(model.solver.groups) if isinstance(each.candidate, SolidBody))


def _has_body(model: FittedModel, trial: BodyTrial) -> bool:
    """Whether a model has nearly this body already, beside these groups and links."""
    held = [each for each in _held_groups(model) if each in model.state.groups]
    if not held or _link(model, held[0]) != trial.body.link or model.state.widths != trial.without.widths:
        return False
    ten = model.solver.groups[held[0]].candidate.added_body(model.solver.values(model.fit, held[0]))
    return ten is not None and bool(np.linalg.norm(trial.body.ten - ten) <= BODY_CHANGE * np.linalg.norm(ten))


def _with_held_body(model: FittedModel, trial: BodyTrial, present: Sequence[int]) -> FittedModel:
    """The model with a body of held form."""
    design, held = model.design, _held_groups(model)
    block = design.block(SolidBody.of_body(design.simulation.arm, trial.body.link, trial.body.ten), 0)
    number = held[0] if held else len(design.blocks)
    design = design.with_blocks({number: block}) if held else replace(design, blocks=(*design.blocks, block))
    moments, solver = design.solver(model.noise)
    gone = [_names(model, present)] if present else []
    gone += [f"links off by {model.state.widths}"] if trial.without.widths != model.state.widths else []
    step = Step(f"one body at link {trial.body.link} in the place of {' and '.join(gone)}", trial.score)
    return FittedModel(design, model.noise, moments, solver, trial.without.plus(number), (*model.steps, step))


def other_bodies(model: FittedModel) -> frozenset[int]:
    """Groups that would add another body to a model that has one of held form."""
    held = set(_held_groups(model)) & set(model.state.groups)
    bodies = {number for number, each in enumerate(model.solver.groups) if each.candidate.effect == PAYLOAD_FACTS.id}
    return frozenset(bodies - held) if held else frozenset()


def impossible_bodies(model: FittedModel) -> tuple[int, ...]:
    """Groups of a model that add a body which cannot exist."""
    if model.design.prior is None or not model.design.settings.guards.physics_signs:
        return ()
    return tuple(each for each in payload_groups(model) if not _is_possible(model, each))


def with_possible_bodies(prediction: Prediction) -> Prediction:
    """The same with added bodies that can exist: where the free fit gives another, the likeliest one that can.

    Of a body of known form that is none: its mass would be negative.
    """
    model = prediction.model
    if not model.design.settings.guards.physics_signs:
        return prediction
    for group in payload_groups(model):
        ten = model.candidate(group).added_body(model.solver.values(model.fit, group))
        if ten is None or not is_possible_body(ten):
            model.solver.hold(model.state, _coefficients_of_possible_body(model, group))
    return prediction


def _coefficients_of_possible_body(model: FittedModel, group: int) -> Array:
    """Coefficients (size,) of a model in which this body can exist."""
    without = model.state.minus(group)
    if isinstance(model.candidate(group), Payload):
        return fit_body(model, without, group, _link(model, group)).coefficients
    return model.solver.free_fit(without).coefficients


def _names(model: FittedModel, groups: Sequence[int]) -> str:
    return " and ".join(f"{model.candidate(each).effect} {_link(model, each)}" for each in groups)


def _link(model: FittedModel, group: int) -> int:
    return model.candidate(group).joints[0]
