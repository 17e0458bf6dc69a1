"""The derivatives of a design that tells rivals apart: those of differences, with the inner fits as they are."""

import numpy as np
import pytest
from next_questions import points, told_apart
from scipy.special import logsumexp

from algorithms.contract import Box
from algorithms.sqp import SQPParams, descend
from armlab.common.derivatives import Derivatives, Question
from armlab.diagnosis.next.decision import decision_strength, log_doubt
from armlab.diagnosis.next.derivative import doubt_terms, strength_slope
from armlab.diagnosis.next.problem import DEFAULT_RIVALS, RivalSettings, TellApartProblem

NOTHING = np.zeros(0, dtype=np.intp)
SPRINGS = (
    RivalSettings(effect="cable_stiffness", joint=2, parameters=(("stiffness", 20.0), ("rest", 0.1))),
    RivalSettings(effect="gravity_compensator", joint=2),
)
FRICTIONS = (
    RivalSettings(effect="coulomb_friction", joint=2, parameters=(("level", 0.2),)),
    RivalSettings(effect="load_dependent_friction", joint=2),
    RivalSettings(effect="nonlinear_viscous_friction", joint=2),
)
EVERY = pytest.mark.parametrize("rivals", [DEFAULT_RIVALS, SPRINGS, FRICTIONS], ids=["late", "spring", "friction"])


def derivatives(problem: TellApartProblem, point: np.ndarray) -> Derivatives:
    return problem.differentiate(point, Question(1.0, NOTHING, 0.3))


@EVERY
def test_the_terms_of_a_doubt_add_up_to_it(rivals: tuple[RivalSettings, ...]) -> None:
    problem = told_apart(*rivals)
    for point in points(problem, 5):
        gram = problem.prepared.total_gram(problem.moments(point).gram)
        (question,) = problem.prepared.questions
        terms = doubt_terms(question, gram, problem.rows)
        assert logsumexp([term.log_doubt for term in terms]) == pytest.approx(log_doubt(question, gram, problem.rows))


@EVERY
def test_the_strength_changes_with_the_gram_matrix_as_its_slope_says(rivals: tuple[RivalSettings, ...]) -> None:
    problem = told_apart(*rivals)
    questions, rows = problem.prepared.questions, problem.rows
    one, other = (problem.moments(point).gram for point in points(problem, 2, seed=4))
    gram, way, step = problem.prepared.total_gram(one + other), one - other, 1e-6
    ends = [decision_strength(questions, gram + sign * step * way, rows) for sign in (1, -1)]
    strength, slope = strength_slope(questions, gram, rows)
    assert strength == decision_strength(questions, gram, rows)
    assert np.sum(slope * way) == pytest.approx((ends[0] - ends[1]) / (2 * step), rel=1e-4)


@EVERY
def test_the_value_has_the_slope_of_differences_along_every_coordinate(rivals: tuple[RivalSettings, ...]) -> None:
    problem, step = told_apart(*rivals), 1e-5
    point = max(
        points(problem, 20), key=problem.strength
    )  # where a motion tells nothing, there are no slopes to compare
    found = derivatives(problem, point)
    assert found.value == pytest.approx(np.log(problem.evaluate(point[None]).value[0]))
    moved = [point + sign * step * unit for unit in np.eye(len(point)) for sign in (1, -1)]
    values = np.log(problem.evaluate(np.array(moved)).value).reshape(-1, 2)
    slopes = (values[:, 0] - values[:, 1]) / (2 * step)
    np.testing.assert_allclose(found.slope, slopes, rtol=1e-3, atol=1e-4 * np.abs(slopes).max() + 1e-9)


def test_a_descent_with_them_tells_more_than_its_start() -> None:
    problem = told_apart(joints=2)
    start = points(problem, 1, seed=1)[0]
    box, params = Box(problem.lower, problem.upper), SQPParams(powers=(1.0,), steps=10, cuts=1)
    *_, end = descend(params, problem.differentiate, box, start)
    assert problem.strength(end) > 1.3 * problem.strength(start)
