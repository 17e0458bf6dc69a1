"""Tests that a package with a problem inherits; each promise of `problem.contract` is a test of its own.

from problem.contract_suite import ProblemContract

class TestMyProblem(ProblemContract):
    settings = MySettings()
"""

import pickle
from typing import Any, ClassVar

import numpy as np

from armlab.common.arrays import Array
from armlab.common.settings import validate
from problem.contract import Evaluation, Problem


class ProblemContract:
    """Inherit, name the class `Test...` and set `settings`; pytest does the rest."""

    settings: ClassVar[Any]

    def test_its_box_is_finite_and_not_empty(self) -> None:
        problem = self._problem()
        assert problem.lower.shape == problem.upper.shape == (len(problem.lower),)
        assert np.isfinite([problem.lower, problem.upper]).all()
        assert (problem.lower < problem.upper).all()

    def test_it_says_of_every_point_fitness_value_and_violation(self) -> None:
        evaluation = self._problem().evaluate(self._points())
        assert [np.shape(figures) for figures in evaluation] == [(7,)] * 3
        assert not np.isnan(evaluation.fitness).any()
        assert not (np.asarray(evaluation.value) < 0.0).any()
        assert (np.asarray(evaluation.violation) >= 0.0).all()

    def test_a_point_has_the_same_figures_to_the_bit_in_any_batch(self) -> None:
        problem, points = self._problem(), self._points()
        for k, point in enumerate(points):
            alone = problem.evaluate(point[None])
            assert _figures_of_point(alone, 0) == _figures_of_point(problem.evaluate(points), k)

    def test_it_leaves_the_points_as_they_are(self) -> None:
        points = self._points()
        self._problem().evaluate(points)
        assert np.array_equal(points, self._points())

    def test_settings_written_out_and_read_again_are_the_same(self) -> None:
        written = self.settings.model_dump(mode="json")
        assert validate(type(self.settings), written, "the settings") == self.settings
        assert isinstance(written["preset"], str)

    def test_settings_can_be_sent_to_another_process(self) -> None:
        assert pickle.loads(pickle.dumps(self.settings)) == self.settings

    def _problem(self) -> Problem:
        problem: Problem = self.settings.build()
        return problem

    def _points(self) -> Array:
        problem = self._problem()
        return np.random.default_rng(0).uniform(problem.lower, problem.upper, (7, len(problem.lower)))


def _figures_of_point(evaluation: Evaluation, k: int) -> list[bytes]:
    return [np.asarray(figures, dtype=float)[k].tobytes() for figures in evaluation]
