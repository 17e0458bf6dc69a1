"""The preset `tell-apart` among the problems of the benchmark."""

from pathlib import Path

import numpy as np
import pytest
from next_questions import points, told_apart
from refusals import refusal

from armlab.common.settings import validate
from armlab.diagnosis.next.motion import Budget, random_point, search_motion
from armlab.diagnosis.next.problem import RivalSettings, TellApartSettings
from bench.execute import canonical
from bench.studies.best_known.records import read_records
from problem.contract_suite import ProblemContract
from problem.excitation import ShiftedProblem
from problem.registry import instances, parse_problem


class TestTellApart(ProblemContract):
    settings = TellApartSettings(duration=4.0, harmonics=4, cutoff_hz=10.0)


def test_its_value_is_one_over_its_strength() -> None:
    problem = told_apart()
    drawn = points(problem, 3)
    assert problem.evaluate(drawn).value == pytest.approx([1 / problem.strength(point) for point in drawn])


def test_no_question_of_its_suite_is_ever_changed() -> None:
    records = read_records(Path(__file__).parents[2] / "results" / "best_known.json")
    for name in instances("tell-apart-1"):
        settings = parse_problem({"preset": name}, "test")
        assert canonical(settings.model_dump(mode="json")) == canonical(records[name.replace("-1/", "-")].settings)


def test_its_settings_have_a_hash_as_the_runner_needs_it() -> None:
    assert hash(TellApartSettings()) == hash(TellApartSettings())


def test_a_frame_seed_moves_the_coordinates() -> None:
    assert isinstance(TellApartSettings(duration=4.0, harmonics=3, frame_seed=1).build(), ShiftedProblem)


def test_an_effect_that_is_no_id_is_refused() -> None:
    given = {"preset": "tell-apart", "rivals": ({"effect": "friction", "joint": 1}, {"effect": "time_delay"})}
    assert "rivals" in refusal(validate, TellApartSettings, given, "the problem")


def test_rivals_without_any_size_are_refused() -> None:
    rivals = (RivalSettings(effect="viscous_friction", joint=2), RivalSettings(effect="time_delay"))
    assert "how large" in refusal(TellApartSettings(rivals=rivals).build)


@pytest.mark.parametrize("algorithm", ["mupso", "gwo", "cma-es"])
def test_registered_algorithms_find_motions_that_tell_more_than_random_ones(algorithm: str) -> None:
    problem = told_apart()
    budget = Budget(4.0, 4, algorithm, 250, seed=3)
    others = [problem.strength(random_point(problem, Budget(seed=seed))) for seed in range(12)]
    assert problem.strength(search_motion(problem, budget)) > np.median(others)


def test_an_unknown_algorithm_is_refused_with_the_nearest_name() -> None:
    message = refusal(search_motion, told_apart(), Budget(4.0, 4, "mupsi", 100))
    assert "did you mean 'mupso'" in message
