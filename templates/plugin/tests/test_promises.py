"""The promises that armlab relies on, inherited, and what only this package can know."""

import numpy as np
from armlab_example.evolution_strategy import EvolutionStrategy
from armlab_example.reaching import ReachingSettings

from algorithms.contract_suite import AlgorithmContract
from problem.contract_suite import ProblemContract


class TestEvolutionStrategy(AlgorithmContract):
    algorithm = EvolutionStrategy


class TestReaching(ProblemContract):
    settings = ReachingSettings()


def test_a_straight_arm_reaches_its_length() -> None:
    problem = ReachingSettings(joints=3, target=(3.0, 0.0)).build()
    assert problem.evaluate(np.zeros((1, 3))).value[0] == 0.0
