"""Tests that a package with an algorithm inherits; each promise of `algorithms.contract` is a test of its own.

from algorithms.contract_suite import AlgorithmContract

class TestMyAlgorithm(AlgorithmContract):
    algorithm = MyAlgorithm
"""

from typing import ClassVar

from algorithms.check import (
    OCCASIONS,
    check_global_randomness,
    check_occasion,
    check_parameters,
    check_pickle,
    check_randomness,
    check_sharing,
)
from algorithms.contract import AnyAlgorithm

_GAME_WITH_PROGRESS, _GAME_WITHOUT_PROGRESS = OCCASIONS["on a bowl"], OCCASIONS["on a constant objective"]


class AlgorithmContract:
    """Inherit, name the class `Test...` and set `algorithm`; pytest does the rest."""

    algorithm: ClassVar[AnyAlgorithm]

    def test_it_has_a_name_and_frozen_parameters_with_defaults(self) -> None:
        check_parameters(self.algorithm)

    def test_it_leaves_the_random_states_of_the_program_alone(self) -> None:
        check_global_randomness(self.algorithm)

    def test_it_asks_for_finite_points_and_reports_the_best_that_it_was_told(self) -> None:
        check_occasion(self.algorithm, "on a bowl")
        check_occasion(self.algorithm, "in one dimension")
        check_occasion(self.algorithm, "on a constant objective")

    def test_it_survives_fitness_that_is_not_finite(self) -> None:
        check_occasion(self.algorithm, "when fitness is NaN or infinite at many points")
        check_occasion(self.algorithm, "when fitness is NaN everywhere")
        check_occasion(self.algorithm, "when fitness is infinite everywhere")

    def test_it_survives_any_horizon(self) -> None:
        check_occasion(self.algorithm, "with a horizon of no iterations")
        check_occasion(self.algorithm, "beyond its horizon")

    def test_the_same_generator_gives_the_same_path_whatever_runs_beside_it(self) -> None:
        check_randomness(self.algorithm, _GAME_WITH_PROGRESS)
        check_randomness(self.algorithm, _GAME_WITHOUT_PROGRESS)

    def test_it_shares_no_array_with_its_caller(self) -> None:
        check_sharing(self.algorithm, _GAME_WITH_PROGRESS)
        check_sharing(self.algorithm, _GAME_WITHOUT_PROGRESS)

    def test_a_state_that_is_pickled_and_read_back_goes_on_as_before(self) -> None:
        check_pickle(self.algorithm, _GAME_WITH_PROGRESS)
        check_pickle(self.algorithm, _GAME_WITHOUT_PROGRESS)
