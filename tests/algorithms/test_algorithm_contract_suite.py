"""The tests that a third party inherits: a faithful algorithm passes them, and they cover every occasion."""

import inspect

import numpy as np
import pytest

from algorithms import contract_suite
from algorithms.check import OCCASIONS, BrokenPromiseError
from algorithms.contract_suite import AlgorithmContract
from algorithms.spso import SPSO


class TestSPSO(AlgorithmContract):
    algorithm = SPSO


class Forgetful(SPSO):
    """Draws from a generator of its own."""

    @staticmethod
    def init(params, population, box, horizon, rng):
        return SPSO.init(params, population, box, horizon, np.random.default_rng())


def suite(algorithm):
    """Tests by name, bound to an algorithm."""
    contract = type("Contract", (AlgorithmContract,), {"algorithm": algorithm})()
    return {name: test for name, test in inspect.getmembers(contract, inspect.ismethod) if name.startswith("test_")}


def test_a_broken_promise_is_found_by_the_test_that_names_it():
    tests = suite(Forgetful)
    with pytest.raises(BrokenPromiseError, match="takes another path"):
        tests["test_the_same_generator_gives_the_same_path_whatever_runs_beside_it"]()
    tests["test_it_has_a_name_and_frozen_parameters_with_defaults"]()


def test_the_suite_plays_every_occasion(monkeypatch):
    played = []
    monkeypatch.setattr(contract_suite, "check_occasion", lambda algorithm, occasion: played.append(occasion))
    for test in suite(SPSO).values():
        test()
    assert sorted(played) == sorted(OCCASIONS)
