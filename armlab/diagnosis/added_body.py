"""One rigid body added to one link: where these data can place it, fitted among bodies that can exist.

The ten parameters of a body have a positive semidefinite pseudo-inertia (Wensing, Kim and Slotine 2018). Data that
excite few of its directions leave the others to that constraint: without it a body at a wrong link, of negative mass or
of impossible spread, fits what belongs to its neighbour. Everything else of the model is fitted beside the body.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize

from armlab.common.arrays import Array
from armlab.diagnosis.evidence import Evidence, Judge
from armlab.diagnosis.fitted_model import FittedModel, inertial_parameters
from armlab.diagnosis.prediction import Prediction
from armlab.diagnosis.pruning import Pruned, reason_to_reject
from armlab.diagnosis.result import Rival
from armlab.diagnosis.search import Step
from armlab.diagnosis.solver import Solver, State
from armlab.effects.links import BODY_SIZE_M, EIGENVALUE_TOLERANCE, PAYLOAD_FACTS, Payload, felt_values
from problem.pseudo_inertia import link_from_pseudo_inertia, pseudo_inertias

SCALE = np.diag(
    [BODY_SIZE_M, BODY_SIZE_M, BODY_SIZE_M, 1.0]
)  # of a pseudo-inertia's factor, so that it is in kilograms
FIRST_MASSES = (1.0, 10.0, 100.0)  # kg, where the search for a body begins
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

    With the other parameters eliminated, half the chi-square is -x'Hx/2 + g'x of the ten parameters x, whose pseudo-
    inertia is S L L' S: unconstrained in the triangular L.
    """
    solver = model.solver
    columns, gram = solver.groups[group].columns, model.moments.gram
    ten_to_felt = np.column_stack([felt_values(model.design.simulation.arm, link, unit) for unit in np.eye(10)])
    scaled = model.moments.lengths[columns][:, None] * ten_to_felt
    matrix, products, other_columns = solver.system(without)
    solved = np.linalg.solve(matrix, products)
    rest = gram[np.ix_(columns, columns)] - products[:, columns].T @ solved[:, columns]
    towards = gram[columns, -1] - products[:, columns].T @ solved[:, -1]
    ten, gain = _likeliest_body(scaled.T @ rest @ scaled, scaled.T @ towards)
    own = scaled @ ten
    coefficients = np.zeros(model.moments.size)
    others = solved[:, -1] - solved[:, columns] @ own
    factor = solver.links(without.widths)[0]
    coefficients[: solver.base] = factor @ others[: factor.shape[1]]
    coefficients[other_columns] = others[factor.shape[1] :]
    coefficients[columns] = own
    return PlacedBody(group, link, ten, coefficients, gain, model.moments.heldout_error(coefficients))


def _likeliest_body(hessian: Array, slope: Array) -> tuple[Array, float]:
    """The ten parameters of the body that maximises slope'x - x'Hx/2, and that maximum."""
    units = np.stack([link_from_pseudo_inertia(unit.reshape(4, 4)).parameters for unit in np.eye(16)], axis=1)
    rows, places = np.tril_indices(4)
    best: tuple[Array, float] = np.zeros(10), 0.0
    for mass in FIRST_MASSES:
        start = np.sqrt(mass) * np.eye(4)
        size = max(abs(float(slope @ (units @ (SCALE @ start @ start.T @ SCALE).ravel()))), 1.0)

        def loss(entries: Array, size: float = size) -> tuple[float, Array]:
            lower = np.zeros((4, 4))
            lower[rows, places] = entries
            body = units @ (SCALE @ lower @ lower.T @ SCALE).ravel()
            pull = hessian @ body - slope
            turned = SCALE @ (units.T @ pull).reshape(4, 4) @ SCALE
            return float(body @ hessian @ body / 2 - slope @ body) / size, ((turned + turned.T) @ lower)[
                rows, places
            ] / size

        found = minimize(loss, start[rows, places], jac=True, method="BFGS", options={"maxiter": 500})
        if -found.fun * size > best[1]:
            lower = np.zeros((4, 4))
            lower[rows, places] = found.x
            best = units @ (SCALE @ lower @ lower.T @ SCALE).ravel(), float(-found.fun * size)
    return best


def is_possible_body(ten: Array, tolerance: float = EIGENVALUE_SHARE) -> bool:
    """Whether ten parameters are those of a body; tolerance: of the largest eigenvalue, in kilograms."""
    kilograms = ten * np.array([1.0, *[1 / BODY_SIZE_M] * 3, *[1 / BODY_SIZE_M**2] * 6])
    values = np.linalg.eigvalsh(pseudo_inertias(kilograms)[0])
    return bool(ten[0] > 0 and values[0] >= -tolerance * float(values[-1]))


def possible_links(model: FittedModel, links: dict[int, Evidence]) -> tuple[FittedModel, dict[int, Evidence]]:
    """The links (from 0) that are bodies as they were found, what they are off included; the log says of the others."""
    if not model.design.settings.guards.physics_signs:
        return model, links
    found = inertial_parameters(model).reshape(-1, 10)
    kept = {link: each for link, each in links.items() if is_possible_body(found[link], EIGENVALUE_TOLERANCE)}
    why = "no body has the mass, centre and inertia that these data give it"
    gone = tuple(Step(f"withdrawn: link {link + 1}: {why}", 0.0) for link in links if link not in kept)
    return replace(model, steps=(*model.steps, *gone)), kept


def predicts_as_well(body: PlacedBody, error: Array, tolerance: float) -> bool:
    """Whether held-out rows leave no more with this body, in the mean of the joints' logarithms."""
    ratio = np.log(np.maximum(body.error, 1e-300)) - np.log(np.maximum(error, 1e-300))
    return bool(np.mean(ratio) <= 2 * np.log1p(tolerance))


def prefer_one_body(pruned: Pruned) -> Pruned:
    """One body that can exist in the place of bodies that cannot, or of several where it predicts as well.

    Where no body does, those that cannot exist are withdrawn: these data do not tell.
    """
    model, effects, links = pruned
    present = payload_groups(model)
    if not present or model.design.prior is None or not model.design.settings.guards.physics_signs:
        return pruned
    groups = model.solver.groups
    bodies = {group: groups[group].candidate.added_body(model.solver.values(model.fit, group)) for group in present}
    impossible = [group for group, ten in bodies.items() if ten is None or not is_possible_body(ten)]
    if not impossible and len(present) == 1:
        return pruned
    without = State(tuple(each for each in model.state.groups if each not in present), model.state.widths)
    error = model.moments.heldout_error(model.fit.coefficients)
    tolerance = model.design.settings.tuning.claims.body_tolerance
    placed = [each for each in place_body(model, without) if each.gain > 0]
    if placed and (impossible or predicts_as_well(placed[0], error, tolerance)):
        chosen = _with_body(model, without, placed[0])
        evidence = Judge(chosen, chosen.state).effects()
        if reason_to_reject(evidence[placed[0].group], model.design.settings) is None:
            kept = {group: each for group, each in evidence.items() if group in effects or group == placed[0].group}
            step = Step(f"one body at link {placed[0].link} in the place of {_names(model, present)}", placed[0].gain)
            return replace(chosen, steps=(*chosen.steps, step)), kept, links
    if not impossible:
        return pruned
    step = Step(f"withdrawn: {_names(model, impossible)}: no body has such a mass, centre and inertia", 0.0)
    state = State(tuple(each for each in model.state.groups if each not in impossible), model.state.widths)
    left = {group: each for group, each in effects.items() if group not in impossible}
    return replace(model, state=state, steps=(*model.steps, step)), left, links


def with_possible_bodies(prediction: Prediction) -> Prediction:
    """The same with added bodies that can exist: where the free fit gives another, the likeliest one that can."""
    model = prediction.model
    if not model.design.settings.guards.physics_signs:
        return prediction
    for group in payload_groups(model):
        ten = model.solver.groups[group].candidate.added_body(model.solver.values(model.fit, group))
        if ten is None or not is_possible_body(ten):
            body = fit_body(model, model.state.minus(group), group, _link(model, group))
            model.solver.hold(model.state, body.coefficients)
    return prediction


def _with_body(model: FittedModel, without: State, body: PlacedBody) -> FittedModel:
    """The model with this body, its parameters as they were found among possible ones."""
    state = without.plus(body.group)
    model.solver.hold(state, body.coefficients)
    return replace(model, state=state)


def _names(model: FittedModel, groups: Sequence[int]) -> str:
    return " and ".join(f"{model.solver.groups[each].candidate.effect} {_link(model, each)}" for each in groups)


def _link(model: FittedModel, group: int) -> int:
    return model.solver.groups[group].candidate.joints[0]


def neighbours_that_fit(model: FittedModel, group: int) -> tuple[Rival, ...]:
    """Payloads at other links that fit these data as well as a payload that was found: by score and held-out rows."""
    if model.design.prior is None or group not in payload_groups(model):
        return ()
    tuning = model.design.settings.tuning.claims
    placed = {each.link: each for each in place_body(model, model.state.minus(group))}
    own = placed.get(_link(model, group))
    if own is None:
        return ()
    return tuple(
        Rival(PAYLOAD_FACTS.id, link, (), False, max(own.gain - each.gain, 0.0))
        for link, each in placed.items()
        if link != own.link
        and own.gain - each.gain <= tuning.max_body_deficit * own.gain
        and predicts_as_well(each, own.error, tuning.body_tolerance)
    )
