"""The regression check from its configuration to its verdict, on small problems."""

import json
from contextlib import nullcontext
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from armlab.common.errors import InputError
from bench.execute import run_trial
from bench.processor import kernels_text
from bench.studies.regression.check import judge_run
from bench.studies.regression.defects import DEFECTS
from bench.studies.regression.sweep import (
    Baseline,
    Cell,
    Ends,
    Sweep,
    group_ends,
    plan_entries,
    read_baseline,
    read_sweep,
    write_baseline,
)
from bench.studies.regression.tasks import BASELINE_FILE, RegressionTasks

SWEEP = """\
name: small
problem: [{preset: sphere, dimension: 3}]
algorithms: [spso, de]
swarm_size: 10
iterations: 15
repetitions: 12
seed: 1
false_alarm_rate: 0.01
baseline: {repetitions: 40, seed: 2}
calibration: {repetitions: 60, seed: 3, defect_repetitions: 20, runs: 50}
"""


@pytest.fixture
def config(tmp_path: Path) -> Path:
    path = tmp_path / "small.yaml"
    path.write_text(SWEEP)
    return path


@pytest.fixture
def sweep(config: Path) -> Sweep:
    return read_sweep(config)


def regression(config: Path) -> RegressionTasks:
    bar = SimpleNamespace(update=lambda trials: None)
    return RegressionTasks(config, config.parent / "results", 1, lambda total, done: nullcontext(bar))


def ends(*values: float) -> Ends:
    return {Cell("paper", "de"): np.array(values)}


def both(*values: float) -> Ends:
    return {Cell("sphere", name): np.array(values) for name in ("spso", "de")}


def test_unchanged_code_passes_and_is_identical_to_the_baselines_own_run(config: Path) -> None:
    check = regression(config)
    assert check.update_baseline().exit_code == 0
    written = (config.parent / "results" / BASELINE_FILE).read_bytes()
    report = check.check()
    assert report.exit_code == 0
    assert report.lines[-1] == (
        "passed: 2 cells, 2 statistics each, family-wise false-alarm rate 0.01; "
        "2 of 2 cells are identical to the baseline's own fixed run."
    )
    assert check.check().lines == report.lines
    check.update_baseline()
    assert (config.parent / "results" / BASELINE_FILE).read_bytes() == written


def test_a_baseline_gets_the_cells_that_it_lacks_and_keeps_the_others_to_the_digit(config: Path) -> None:
    task = regression(config)
    task.update_baseline()
    path = task.results / BASELINE_FILE
    before = json.loads(path.read_text())
    config.write_text(SWEEP.replace("[spso, de]", "[spso, woa, de]"))
    assert task.extend_baseline().lines[0].endswith("1 cells are new, 2 as they were")
    after = json.loads(path.read_text())
    assert [cell["algorithm"] for cell in after["cells"]] == ["spso", "woa", "de"]
    assert [after["cells"][place] for place in (0, 2)] == before["cells"]
    assert after["kept"] == before["provenance"]
    assert task.check().exit_code == 0
    assert "has every cell" in task.extend_baseline().lines[0]
    config.write_text(config.read_text().replace("seed: 2}", "seed: 7}"))
    with pytest.raises(InputError, match="was made with another 'baseline'"):
        task.extend_baseline()


def test_cells_that_call_lapack_say_their_kernels_and_are_compared_as_distributions_on_others(config: Path) -> None:
    config.write_text(SWEEP.replace("[spso, de]", "[spso, cma-es]"))
    task = regression(config)
    task.update_baseline()
    path = task.results / BASELINE_FILE
    here = kernels_text()
    assert [cell.get("kernels") for cell in json.loads(path.read_text())["cells"]] == [None, here]
    report = task.check()
    assert report.lines[-2].endswith("2 of 2 cells are identical to the baseline's own fixed run.")
    assert report.lines[-1] == f"Cells of cma-es call LAPACK: here they are of {here}, as those of the baseline."
    path.write_text(path.read_text().replace(here, "openblas 0.1 Prescott (X86_V1)"))
    report = task.check()
    assert report.exit_code == 0
    assert report.lines[-2].endswith(
        "1 of 1 cells are identical to the baseline's own fixed run, "
        "1 of other kernels were compared as distributions alone."
    )
    assert report.lines[-1] == (
        f"Cells of cma-es call LAPACK: here they are of {here}, "
        "those of the baseline of openblas 0.1 Prescott (X86_V1)."
    )


def test_a_cell_without_kernels_gets_these_where_its_fixed_run_comes_out_the_same_else_it_is_made_anew(
    config: Path,
) -> None:
    config.write_text(SWEEP.replace("[spso, de]", "[spso, cma-es]"))
    task = regression(config)
    task.update_baseline()
    path = task.results / BASELINE_FILE
    named = json.loads(path.read_text())["cells"]
    path.write_text(path.read_text().replace(f', "kernels": "{kernels_text()}"', ""))
    assert task.check().lines[-1].endswith("those of the baseline of kernels that it does not name.")
    assert task.extend_baseline().lines[0].endswith("0 cells are new, 2 as they were")
    assert json.loads(path.read_text())["cells"] == named
    other = json.loads(path.read_text())
    del other["cells"][1]["kernels"]
    other["cells"][1]["fixed_run"][0] *= 1.001
    path.write_text(json.dumps(other))
    assert task.extend_baseline().lines[0].endswith("1 cells are new, 1 as they were")
    assert json.loads(path.read_text())["cells"] == named


def test_a_defect_fails_the_check_with_its_algorithm_named(config: Path) -> None:
    check = regression(config)
    check.update_baseline()
    with DEFECTS["de-without-selection"].inject():
        report = check.check()
    assert report.exit_code == 1
    (sentence,) = [line for line in report.lines if line.startswith("de on sphere is WORSE: median ")]
    assert sentence.endswith(" after Holm.")
    assert not any(line.startswith("spso on") for line in report.lines)


def test_calibration_writes_rates_power_and_what_each_defect_printed(config: Path) -> None:
    check = regression(config)
    check.update_baseline()
    report = check.calibrate()
    figures = json.loads((config.parent / "results/regression_calibration.json").read_text())
    assert len(report.lines) == 2
    assert 0 <= figures["false_alarm_rate"]["committed_baseline"] <= 0.2
    assert set(figures["power"]["+0.15"]) == {"spso on sphere", "de on sphere"}
    assert figures["defects"]["de-without-selection"]["found_by_fixed_run"]
    assert figures["defects"]["de-without-selection"]["power"] == 1.0
    assert not figures["defects"]["sign-of-a-column"]["found_by_fixed_run"]
    assert "mupso-without-mutation" not in figures["defects"]  # MuPSO takes no part here
    page = (config.parent / "results/regression_calibration.md").read_text()
    assert "de on sphere is WORSE: median " in page


def test_a_worse_cell_is_told_in_a_sentence_with_its_factor() -> None:
    baseline = Baseline(ends(*np.linspace(10, 20, 41)), ends(*np.linspace(10, 20, 21)))
    verdict = judge_run(baseline, ends(*np.linspace(20, 40, 21)), 0.01)
    assert not verdict.passed
    assert verdict.sentences()[0].startswith(
        "de on paper is WORSE: median 15.00 -> 30.00 (x 2.00), best 10.00 -> 20.00 (x 2.00), p = "
    )
    assert verdict.identical == 0


def test_a_cell_that_is_too_good_fails_too() -> None:
    baseline = Baseline(ends(*np.linspace(10, 20, 41)), ends(*np.linspace(10, 20, 21)))
    assert (
        "de on paper is BETTER than chance allows"
        in judge_run(baseline, ends(*np.linspace(5, 10, 21)), 0.01).lines()[2]
    )


def test_an_end_that_violates_a_limit_counts_as_infinite_and_others_with_nine_digits(sweep: Sweep) -> None:
    spso = plan_entries(sweep)[:3]
    outcomes = [replace(run_trial(spso[0].trial), value=1 / 3, violation=broken) for broken in (0.0, 0.2, 0.0)]
    (values,) = group_ends(zip(spso, outcomes, strict=True)).values()
    np.testing.assert_array_equal(values, [0.333333333, np.inf, 0.333333333])


def test_a_baseline_with_infeasible_ends_survives_the_file(sweep: Sweep, tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    write_baseline(path, sweep, Baseline(both(3.25, np.inf, 1.5), both(np.inf)))
    read = read_baseline(path, sweep)
    np.testing.assert_array_equal(read.ends[Cell("sphere", "de")], [1.5, 3.25, np.inf])
    np.testing.assert_array_equal(read.fixed_run[Cell("sphere", "de")], [np.inf])
    assert "provenance" in json.loads(path.read_text())


def test_a_baseline_of_other_settings_is_refused_with_the_key(sweep: Sweep, tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    write_baseline(path, sweep, Baseline(ends(1.0), ends(1.0)))
    other = sweep.model_copy(update={"swarm_size": (20,)})
    with pytest.raises(InputError, match="made with another 'swarm_size' than configuration 'small' has: make it anew"):
        read_baseline(path, other)


def test_a_baseline_without_a_cell_is_refused(sweep: Sweep, tmp_path: Path) -> None:
    path = tmp_path / "baseline.json"
    write_baseline(path, sweep, Baseline(ends(1.0), ends(1.0)))
    with pytest.raises(InputError, match=r"'cells' in .* are not those of configuration 'small': make it anew"):
        read_baseline(path, sweep)


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (None, "there is no baseline"),
        ("{", "cannot read the baseline"),
        ("[]", "is not a baseline of schema"),
        ('{"schema": "regression-baseline/1"}', "'configuration' is missing"),
    ],
)
def test_a_missing_or_broken_baseline_is_one_line(
    content: str | None, complaint: str, sweep: Sweep, tmp_path: Path
) -> None:
    path = tmp_path / "baseline.json"
    if content is not None:
        path.write_text(content)
    with pytest.raises(InputError, match=complaint) as caught:
        read_baseline(path, sweep)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("right", "wrong", "complaint"),
    [
        ("seed: 2", "seed: 1", "should be three different numbers"),
        ("swarm_size: 10", "swarm_size: [10, 20]", "should have one 'swarm_size' and one budget"),
        ("repetitions: 60", "repetitions: 50", "'calibration.repetitions' should be enough"),
        ("defect_repetitions: 20", "defect_repetitions: 11", "'calibration.defect_repetitions' should be enough"),
        ("false_alarm_rate: 0.01", "false_alarm_rate: 1.0", "'false_alarm_rate'"),
        ("runs: 50", "run: 50", "did you mean 'runs'"),
    ],
)
def test_a_mistake_in_the_configuration_is_one_line(right: str, wrong: str, complaint: str, config: Path) -> None:
    config.write_text(SWEEP.replace(right, wrong))
    with pytest.raises(InputError, match=complaint) as caught:
        read_sweep(config)
    assert "\n" not in str(caught.value)
