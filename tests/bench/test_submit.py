"""Submitted trajectories are verified at every instant, and get their row or one line that says why not."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml
from refusals import refusal

from bench.studies.best_known.descent import evaluate_point
from bench.studies.best_known.records import Record, build_excitation, write_records
from bench.studies.best_known.submit import judge_submission
from problem.excitation import ExcitationProblem
from problem.registry import parse_problem

SETTINGS = {"preset": "joint-fourier", "arm": "irb120", "joints": 4, "harmonics": 2, "samples": 60}
WITH_FLOOR = SETTINGS | {"collisions": {"floor": 0.0}}


def problem_of(settings: dict[str, object]) -> ExcitationProblem:
    return build_excitation(parse_problem(settings, "test"), "test")


def gentle(share: float = 0.15) -> np.ndarray:
    """A motion about the middle of the ranges that uses a share of the box of its coefficients."""
    problem = problem_of(SETTINGS)
    middle, half = (problem.lower + problem.upper) / 2, (problem.upper - problem.lower) / 2
    signs = np.random.default_rng(0).choice([-1.0, 1.0], len(middle))
    q0 = np.array([name.startswith("q0") for name in problem.trajectory.names])
    return np.where(q0, middle, middle + share * signs * half)


@pytest.fixture
def submit(tmp_path: Path) -> Callable[..., list[str]]:
    """Submits a point to the record of a problem; the lines that are printed."""

    def run(point: np.ndarray, settings: dict[str, object] = WITH_FLOOR, **keys: object) -> list[str]:
        problem, full = problem_of(settings), parse_problem(settings, "test").model_dump(mode="json")
        names = problem.trajectory.names
        record = Record(
            settings=full,
            value=evaluate_point(problem, gentle()).value,
            coefficients=dict(zip(names, gentle().tolist(), strict=True)),
            method="kick",
            seed=0,
            start=0,
            evaluations=0,
            gradients=0,
            versions={},
        )
        write_records(tmp_path / "records.json", {"small": record})
        content = {
            "problem": "small",
            "by": "Jane Doe",
            "coefficients": dict(zip(names, point.tolist(), strict=True)),
        } | keys
        (tmp_path / "trajectory.yaml").write_text(yaml.safe_dump(content))
        return list(judge_submission(tmp_path / "trajectory.yaml", tmp_path / "records.json"))

    return run


def test_a_good_trajectory_gets_its_row_with_what_it_uses_and_keeps(submit: Callable[..., list[str]]) -> None:
    first, *checked, headings, _, row = submit(gentle())
    assert first.endswith("(1 times)")
    assert any("at every instant" in line for line in checked)
    cells = dict(zip(headings.split(" | "), row.split(" | "), strict=True))
    assert cells["by |"] == "Jane Doe |"
    assert cells["floor"].endswith(" mm")
    assert float(cells["speed"].rstrip("%")) < 100


def test_a_limit_that_is_broken_between_the_samples_alone_is_refused(submit: Callable[..., list[str]]) -> None:
    problem, point = problem_of(SETTINGS), gentle()
    q0 = np.array([name.startswith("q0") for name in problem.trajectory.names])
    low, high = 0.1, 10.0
    while high - low > 1e-9:  # the largest motion that keeps the limits at the samples
        scale = (low + high) / 2
        kept = problem.evaluate(np.where(q0, point, scale * point)[None]).violation[0] == 0
        low, high = (scale, high) if kept else (low, scale)
    told = refusal(submit, np.where(q0, point, low * point), SETTINGS)
    assert "breaks a limit, at the samples or between them: position uses 100." in told


def test_a_trajectory_that_collides_is_refused_with_the_parts_and_the_instant(
    submit: Callable[..., list[str]],
) -> None:
    point, names = gentle(0.02), problem_of(SETTINGS).trajectory.names
    point[names.index("q0_2")], point[names.index("q0_3")] = 1.5, 0.8  # bent down, in front of the base
    told = refusal(submit, point)
    assert "inside the floor" in told
    assert " s the motion has the link of " in told
    assert submit(point, SETTINGS)  # the same motion where nobody asks for collisions


def test_numbers_that_are_far_too_large_break_a_limit(submit: Callable[..., list[str]]) -> None:
    assert "breaks a limit" in refusal(submit, 1e307 * gentle())


def test_mistakes_in_a_submission_are_told_in_one_line(submit: Callable[..., list[str]]) -> None:
    assert refusal(submit, gentle(), problem="smal").endswith("records.json: did you mean 'small'?")
    assert "coefficients lacks 20 of 20, a1_1 the first" in refusal(submit, gentle(), coefficients={})
    extra = dict.fromkeys((*problem_of(SETTINGS).trajectory.names, "a9_1"), 0.0)
    assert "unknown coefficient 'a9_1'" in refusal(submit, gentle(), coefficients=extra)
