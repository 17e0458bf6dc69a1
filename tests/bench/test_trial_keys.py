"""A trial's key is the hash of everything that decides its outcome, and of nothing else."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import pytest

from armlab.common.settings import Settings
from bench.config import Experiment, find_algorithm, parse_params, read_experiment
from bench.execute import Trial
from bench.fingerprint import fingerprint
from bench.plan import plan_trials
from problem.registry import parse_problem


class Bowl(Settings):
    preset: str = "bowl"
    dimension: int = 3

    def build(self) -> object:
        raise NotImplementedError


@dataclass(frozen=True)
class Params:
    inertia: float = 0.72


SPHERE = parse_problem({"preset": "sphere", "dimension": 3}, "test")
TRIAL = Trial(Bowl(), "spso", Params(), 50, 1550, "clip", 2024, 0)


def test_the_key_of_a_trial_is_this_one_for_ever() -> None:
    assert TRIAL.key("code") == "661c9c4ad40ef2bad8e9f4ea9693350c58a475d58456195b6ac6e2a6891e710a"


@pytest.mark.parametrize(
    "other",
    [
        replace(TRIAL, problem=Bowl(dimension=4)),
        replace(TRIAL, algorithm="mupso"),
        replace(TRIAL, params=Params(0.73)),
        replace(TRIAL, swarm_size=51),
        replace(TRIAL, evaluations=1551),
        replace(TRIAL, bounds="wrap"),
        replace(TRIAL, seed=2025),
        replace(TRIAL, repetition=1),
        replace(TRIAL, derivative_price=5),
    ],
)
def test_whatever_changes_the_outcome_changes_the_key(other: Trial) -> None:
    assert other.key("code") != TRIAL.key("code")


def test_other_code_gives_another_key() -> None:
    assert TRIAL.key("code") != TRIAL.key("other code")


def test_labels_and_the_name_of_the_experiment_leave_the_keys_alone(small: Path) -> None:
    experiment = read_experiment(small)
    text = small.read_text().replace("name: small", "name: other").replace("dimension: 3", "dimension: 3, label: x")
    small.write_text(text.replace("[spso, de]", "[{name: spso, label: swarm}, de]"))
    assert _keys(read_experiment(small)) == _keys(experiment)


def test_default_parameters_written_out_leave_the_keys_alone(small: Path) -> None:
    experiment = read_experiment(small)
    small.write_text(small.read_text().replace("[spso, de]", "[{name: spso, params: {inertia: 0.72}}, de]"))
    assert _keys(read_experiment(small)) == _keys(experiment)


def test_iterations_and_the_same_budget_in_evaluations_are_the_same_trials(small: Path) -> None:
    experiment = read_experiment(small)
    small.write_text(small.read_text().replace("iterations: 4", "evaluations: 25"))
    assert _keys(read_experiment(small)) == _keys(experiment)


def test_the_fingerprint_of_a_third_party_is_that_of_its_own_file_too(plug_in: object, tmp_path: Path) -> None:
    assert callable(plug_in)
    plug_in("pass")
    plug_in_file, algorithm = tmp_path / "site" / "plug_in.py", find_algorithm("plug-in", "")
    before = fingerprint(algorithm, SPHERE)
    plug_in_file.write_text(plug_in_file.read_text() + "FACTOR = 2\n")
    assert fingerprint(algorithm, SPHERE) != before


def test_a_file_that_the_problem_names_belongs_to_the_fingerprint(tmp_path: Path) -> None:
    robot, algorithm = tmp_path / "robot.yaml", find_algorithm("de", "")
    robot.write_text("mass: 1")
    problem = parse_problem({"preset": "paper", "arm": str(robot)}, "test")
    before = fingerprint(algorithm, problem)
    robot.write_text("mass: 2.0")
    assert fingerprint(algorithm, problem) != before


def _keys(experiment: Experiment) -> list[str]:
    return [entry.key for entry in plan_trials(experiment, "small.yaml")]


def test_a_parameter_may_have_a_default_that_is_made_for_each() -> None:
    @dataclass(frozen=True)
    class Params:
        powers: tuple[int, ...] = field(default_factory=lambda: (1, 2))

    assert parse_params(Params, {}, "mine").powers == (1, 2)
