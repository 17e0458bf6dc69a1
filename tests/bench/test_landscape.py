"""`armlab bench landscape`: features with known answers, what correlations may claim, and pages from small tables."""

import re
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pandas as pd
import pytest

from algorithms.registry import names_with_derivatives
from armlab.common.errors import InputError
from bench.errors import StoppedError
from bench.studies.landscape import landscape_study, measure, standing
from bench.studies.landscape.basins import Ends, find_symmetry
from bench.studies.landscape.curvature import curvature_of, measure_curvature
from bench.studies.landscape.features import Effort
from bench.studies.landscape.landscape_study import LandscapeOptions, make_landscape
from bench.studies.landscape.ratios import mean_ratio, quartile_ratio
from bench.studies.landscape.sampling import (
    SamplingSettings,
    distance_correlation,
    feasible_share,
    information_content,
    random_walk,
    walk_correlation,
)
from bench.studies.landscape.standing import BETTER, CANNOT_TELL, FEATURES, WORSE, correlation_table, standings
from problem.registry import parse_problem

ROOT = Path(__file__).parents[2]
PAGES = tuple(ROOT / "results" / "landscape" / name for name in ("landscape.md", "which-optimiser.md"))
SMALL = {"preset": "joint-fourier", "harmonics": 2, "samples": 40}
TINY = Effort(SamplingSettings(points=100, distances=50, walks=1, steps=20), gradients=1, descents=2)


def silent_bar(total: int, done: int) -> Any:
    return nullcontext(SimpleNamespace(update=lambda n: None))


@pytest.fixture
def few_permutations(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(standing, "PERMUTATIONS", 1999)


def small_problem(**given: Any) -> Any:
    return parse_problem({**SMALL, **given}, "test").build()


def test_information_content_equals_that_of_pflacco() -> None:
    """pflacco 1.2.2 on the same walk, whose steps grow, so that its tour of nearest neighbours keeps the order."""
    values = [2.04, -0.51, -0.1, -0.66, -1.12, -1.33, -3.35, -3.58, -4.45, -1.13, -0.9, -1.25, -1.53, -2.2, -3.26]
    values += [-3.65, -3.17, -3.41, -2.45, -2.65, -2.62, -1.08, -0.53, -1.04, -1.22, -0.68, 1.26, 0.99, 0.74, 1.74]
    distances = np.linspace(0.5, 1.0, 30)[1:]
    assert information_content(np.array(values), distances) == pytest.approx(0.8593598807898388, rel=1e-12)


def test_a_walk_stays_in_the_box_and_takes_steps_of_the_stated_size() -> None:
    walk = random_walk(3, 5000, 0.05, np.random.default_rng(1))
    assert np.abs(walk).max() <= 1
    assert np.diff(walk, axis=0).std() == pytest.approx(0.05, rel=0.05)


def test_neighbours_that_alternate_have_a_correlation_of_minus_one() -> None:
    assert walk_correlation(np.array([[0.0, 1.0, 0.0, 1.0, 0.0, 1.0]])) == pytest.approx(-1)


def test_on_a_cone_fitness_is_the_distance_to_the_best() -> None:
    shares = np.random.default_rng(2).uniform(-1, 1, (50, 4))
    best = np.full(4, 0.3)
    assert distance_correlation(np.linalg.norm(shares - best, axis=1), shares, best) == pytest.approx(1)


def test_the_feasible_share_is_that_of_evaluated_points() -> None:
    problem = small_problem(duration=3.0)
    rng, same = np.random.default_rng(3), np.random.default_rng(3)
    points = problem.lower + (same.uniform(-1, 1, (500, len(problem.lower))) + 1) / 2 * (problem.upper - problem.lower)
    assert feasible_share(problem, 500, rng) == (problem.evaluate(points).violation == 0).mean() > 0


def test_motions_that_differ_by_a_symmetry_are_the_same() -> None:
    problem = small_problem(duration=5.0)
    rng = np.random.default_rng(4)
    symmetry = find_symmetry(problem, rng.uniform(problem.lower, problem.upper, (5, len(problem.lower))))
    assert symmetry.turning.tolist() == [True, False, False]  # joint 1 is vertical
    assert symmetry.reversible
    assert symmetry.periodic
    phase = np.linspace(0, 2 * np.pi, 1001)
    motion = np.stack([np.sin(phase), 0.3 + np.cos(2 * phase), np.sin(phase + 1)], axis=1)
    begun_later = np.concatenate([motion[300:-1], motion[:301]])
    assert symmetry.distance(motion, begun_later) < 2e-3  # the last instant counts twice in a mean
    assert symmetry.distance(motion, motion[::-1] * np.array([-1, 1, 1]) + np.array([0.7, 0, 0])) < 2e-3
    assert symmetry.distance(motion, motion + np.array([0, 0.5, 0])) > 0.3


def test_ends_meet_only_where_motion_and_value_agree() -> None:
    values = np.array([10.0, 10.0, 10.0, 12.0])
    distances = np.array([[0, 0.01, 1, 0.01], [0.01, 0, 1, 0.01], [1, 1, 0, 1], [0.01, 0.01, 1, 0]])
    ends = Ends(values, distances)
    assert ends.count == 3  # the third has another motion, the fourth another value
    assert ends.meeting_share() == pytest.approx(1 / 6)
    assert ends.meeting_share(0.1) == 0  # of the tolerances


def test_curvature_leaves_flat_directions_out() -> None:
    found = curvature_of(np.diag([1.0, 10.0, 1e-9, -2.0]))
    assert (found.condition, found.free, found.flat, found.negative) == (10.0, 4, 1, 1)


def test_the_mean_of_a_vertical_joint_is_a_flat_direction() -> None:
    problem = small_problem(limits={"position": [None, None, None]}, coefficient_limit=0.2)
    point = np.random.default_rng(5).uniform(problem.lower, problem.upper) * 0.9
    found = measure_curvature(problem, point)
    assert found.free == len(point)
    assert found.flat >= 1
    assert found.condition > 1


def test_an_infeasible_median_ranks_behind_by_its_feasible_share() -> None:
    table = pd.DataFrame(
        {
            "problem": "p",
            "algorithm": list("abcd"),
            "median": [np.inf, 3.0, np.inf, 2.0],
            "feasible_share": [0, 1, 0.4, 1],
        }
    )
    assert standings(table).loc["p"].to_dict() == {"a": 4, "b": 2, "c": 3, "d": 1}


def planted(problems: int, rng: np.random.Generator) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Features of which one decides the order of two algorithms, and their ranks."""
    names = [f"p{number}" for number in range(problems)]
    features = pd.DataFrame({name: rng.normal(size=problems) for name in FEATURES})
    features = features.assign(problem=names, landscape=names, joints=np.arange(problems) % 2)
    decided = features["dimension"].rank().to_numpy()
    ranks = pd.DataFrame({"one": decided, "two": -decided, "chance": rng.permutation(decided)}, index=names)
    return features, ranks


def test_a_planted_feature_is_found_and_found_again_and_noise_is_not(few_permutations: None) -> None:
    rng = np.random.default_rng(6)
    (first, found_in), (second, checked_in) = planted(21, rng), planted(12, rng)
    second = second.assign(problem="q" + second["problem"], landscape="q" + second["landscape"])
    checked_in.index = "q" + checked_in.index
    table = correlation_table(pd.concat([first, second]), found_in, checked_in).set_index(["feature", "algorithm"])
    assert table.loc[("dimension", "one"), ["verdict", "confirmed"]].tolist() == [WORSE, True]
    assert table.loc[("dimension", "two"), ["verdict", "confirmed"]].tolist() == [BETTER, True]
    assert (table[table.index.get_level_values("feature") != "dimension"]["verdict"] == CANNOT_TELL).all()


def test_a_feature_that_only_tells_arms_apart_says_nothing_within_them(few_permutations: None) -> None:
    features, ranks = planted(20, np.random.default_rng(7))
    features["dimension"] = features["joints"] * 100.0
    table = correlation_table(features, ranks, ranks).set_index(["feature", "algorithm"])
    assert np.isnan(table.loc[("dimension", "one"), "within_arms"])


def test_the_smallest_correlation_follows_fieller() -> None:
    assert standing.smallest_correlation(21, 0.05) == pytest.approx(
        np.tanh((1.95996 + 0.84162) * (1.06 / 18) ** 0.5), rel=1e-4
    )


def test_problems_of_one_landscape_count_once_and_infeasible_ones_not_at_all() -> None:
    names = list("abcdefgh")
    ours = pd.Series([2.0, 2.0, *[4.0] * 5, np.inf], names)
    groups = pd.Series(["ab", "ab", *names[2:]], names)
    ratio = mean_ratio(ours, pd.Series(1.0, names), groups)
    assert ratio.value == pytest.approx(np.exp(np.mean(np.log([2, 4, 4, 4, 4, 4]))))
    assert (ratio.problems, ratio.without, ratio.ranged) == (7, 1, False)
    assert ratio.told_apart
    few = mean_ratio(ours[:3], pd.Series(1.0, names)[:3], groups)
    assert (few.low, few.high, few.ranged) == (pytest.approx(2), pytest.approx(4), True)


def test_the_interval_from_quartiles_holds_the_ratio() -> None:
    rng = np.random.default_rng(8)
    ends = np.exp(rng.normal(scale=0.2, size=(400, 2, 12)))
    held = 0
    for one, other in ends:
        rows = [
            dict(zip(("lower_quartile", "median", "upper_quartile"), np.quantile(each, [0.25, 0.5, 0.75]), strict=True))
            for each in (one, other)
        ]
        _, low, high = quartile_ratio(*rows, repetitions=12)
        held += low <= 1 <= high
    assert 0.88 < held / len(ends) < 0.99


def test_problems_that_differ_in_their_frame_are_measured_once_and_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    labels = ["suite-1/irb120-arm-joint-h5-t10-origin", "suite-1/irb120-arm-joint-h5-t10-shifted"]
    (work,) = measure.list_work(labels, TINY, tmp_path / "no-records.json")
    assert work.labels == tuple(labels)
    end = {"point": [0.0], "value": 12.0, "feasible": True, "gradients": 3}
    results = {"landscape": {}, "ends": [end]}
    monkeypatch.setattr(measure.Work, "measure", lambda self, effort: results)
    measure.measure_all([work], TINY, tmp_path / "store", 1, silent_bar)
    monkeypatch.delattr(measure.Work, "measure")
    assert measure.measure_all([work], TINY, tmp_path / "store", 1, silent_bar) == [results]
    assert len(measure.ends_table([work], [results])) == 1


def test_a_stopped_measurement_keeps_what_is_done(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    labels = ["suite-1/irb120-arm-joint-h3-t5-origin", "suite-1/irb120-arm-rest-h4-t5-shifted"]
    first, second = work = measure.list_work(labels, TINY, tmp_path / "none.json")

    def stop_at_second(self: measure.Work, effort: Effort) -> dict[str, Any]:
        if self == second:
            raise KeyboardInterrupt
        return {"landscape": {}, "ends": []}

    monkeypatch.setattr(measure.Work, "measure", stop_at_second)
    with pytest.raises(StoppedError, match="the same command goes on"):
        measure.measure_all(work, TINY, tmp_path / "store", 1, silent_bar)
    assert [path.stem for path in (tmp_path / "store").iterdir()] == [first.key]


def test_another_effort_is_another_key(tmp_path: Path) -> None:
    label = ["suite-1/irb120-arm-joint-h3-t5-origin"]
    keys = [
        measure.list_work(label, each, tmp_path / "none.json")[0].key for each in (TINY, replace(TINY, gradients=2))
    ]
    assert len(set(keys)) == 2


def test_the_features_of_a_problem_are_the_same_again(tmp_path: Path) -> None:
    (work,) = measure.list_work(["suite-1/irb120-arm-joint-h3-t5-origin"], TINY, tmp_path / "none.json")
    (first,), (again,) = (measure.measure_all([work], TINY, tmp_path / name, 1, silent_bar) for name in ("one", "two"))
    assert first == again
    row = measure.feature_table([work], [first]).iloc[0]
    assert (row["dimension"], row["descents"], row["joints"], row["form"]) == (21, 2, 3, "joint")
    assert 5 < row["best"] < 20


def committed(tmp_path: Path) -> LandscapeOptions:
    out = tmp_path / "landscape"
    out.mkdir()
    for name in ("landscape.csv", "landscape_ends.csv", "landscape.settings.yaml"):
        (out / name).write_bytes((ROOT / "results" / "landscape" / name).read_bytes())
    return LandscapeOptions(ROOT / "results", out, tmp_path / "store", 1, pages=True)


def test_the_committed_pages_say_what_the_results_say(tmp_path: Path) -> None:
    """If this fails after a new run of a study: `armlab bench landscape --pages`."""
    options = committed(tmp_path)
    written = list(make_landscape(options, silent_bar))
    assert len(written) == 7
    for page in PAGES:
        assert (options.out / page.name).read_text() == page.read_text()


def test_the_page_says_how_the_papers_six_stand_under_other_readings() -> None:
    text = (ROOT / "results" / "landscape" / "which-optimiser.md").read_text()
    section = text.partition("## Other readings of the algorithms")[2].partition("## ")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in section.splitlines() if line[:2] == "| "][2:]
    assert [row[0] for row in rows] == ["MuPSO", "SPSO", "WOA", "GWO", "GOA", "DE"]
    assert [row[0] for row in rows if row[-1] == "-"] == ["MuPSO", "SPSO"]  # of which no program is published
    woa, choice = (
        pd.read_csv(ROOT / "results" / "suite" / f"{name}.csv")
        .query("algorithm == @label")
        .set_index("problem")["median"]
        for name, label in (("suite_readings", "woa program"), ("suite", "ipop-cma-es"))
    )
    ratios = np.log(woa / choice)
    assert float(rows[2][-1].split()[0]) == pytest.approx(np.exp(ratios[np.isfinite(ratios)].mean()), rel=0.03)
    assert "All this is of the algorithms as read here" in text


def test_the_committed_pages_have_a_held_out_answer_for_every_algorithm() -> None:
    tables = [pd.read_csv(ROOT / "results" / "suite" / name) for name in ("suite.csv", "suite_heldout.csv")]
    rows = [table.groupby("problem") for table in tables]
    algorithms = [set(each["algorithm"].agg(tuple)) for each in rows]
    assert algorithms[0] == algorithms[1]
    assert len(algorithms[0]) == 1
    for page in PAGES:
        assert not re.search(r"\bnan\b", page.read_text())


def test_rows_that_ask_for_derivatives_answer_for_them(
    tmp_path: Path, few_permutations: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(landscape_study, "draw_landscape", lambda *tables: {})
    options = committed(tmp_path)
    results = tmp_path / "results"
    for path in (ROOT / "results").rglob("*"):
        if path.suffix in (".csv", ".yaml", ".json") and path.parent.name in (
            "suite",
            "speed",
            "derivatives",
            "study",
            "search_space",
            "tune",
        ):
            place = results / path.relative_to(ROOT / "results")
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_bytes(path.read_bytes())
    for name in ("suite", "suite_heldout"):
        table = pd.read_csv(results / "suite" / f"{name}.csv")
        table = table[~table["algorithm"].isin(names_with_derivatives())]
        best = table[table["algorithm"] == "ipop-cma-es"]
        added = best.assign(algorithm="sqp", median=best["median"] / 2)
        pd.concat([table, added]).to_csv(results / "suite" / f"{name}.csv", index=False)
    list(make_landscape(replace(options, results=results), silent_bar))
    page = (options.out / "which-optimiser.md").read_text()
    assert "**sqp**. On the held-out suite ipop-cma-es ends 2.00 (2.00 to 2.00) times as high." in page
    assert "| sqp | 1.00 | 100% | 24 | 1 |" in page


def test_pages_without_a_measured_problem_are_refused(tmp_path: Path) -> None:
    options = committed(tmp_path)
    table = pd.read_csv(options.out / "landscape.csv")
    table[1:].to_csv(options.out / "landscape.csv", index=False)
    with pytest.raises(InputError, match=r"has no row of 'suite-1/irb120-arm-tool-h3-t10-origin'"):
        list(make_landscape(options, silent_bar))
    (options.out / "landscape.csv").unlink()
    with pytest.raises(InputError, match="there is no such file"):
        list(make_landscape(options, silent_bar))
