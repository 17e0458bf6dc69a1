"""The study of windows of real runs: its statistics, its criteria, its identification, its page."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from refusals import refusal
from scipy.stats import spearmanr
from simulated_arm import arm, run, structure, truth

import armlab.proof.open.conditioning.arm as conditioning_arm
import armlab.proof.open.conditioning.conditioning_study as study
import armlab.proof.open.conditioning.correlation as correlation
from armlab.common.arrays import Array
from armlab.identification.identifier import Identifier
from armlab.identification.regression import Regression
from armlab.identification.torque_model import TorqueModel
from armlab.identification.validation import run_error
from armlab.proof.open.conditioning.answer import MEAN, median_of_preferred, verdict
from armlab.proof.open.conditioning.arm import ArmWindows, simulated_torques, study_arm
from armlab.proof.open.conditioning.conditioning_page import CHOICES_NAME, PAGE_NAME, TABLE_NAME
from armlab.proof.open.conditioning.correlation import BlockCorrelation, average, correlate
from armlab.proof.open.conditioning.criteria import CRITERIA, prediction_criterion, window_criteria
from armlab.proof.open.conditioning.windows import RunWindows, block_rows
from armlab.proof.open.real_identification.identify_recording import Recipe
from armlab.recordings.recording import Recording, Transmission

RECIPE = Recipe("emps", {})


@pytest.fixture(scope="module")
def recording() -> Recording:
    model = structure()
    runs = (
        run(model, truth(model), seed=1, noise=0.5, role="identify"),
        run(model, truth(model), seed=2, noise=0.5, role="validate"),
    )
    transmission = Transmission(np.eye(3), np.zeros(3), np.eye(3), np.ones(3))
    return Recording(Path("simulated"), "irb120-arm", arm(), runs, transmission)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(correlation, "PERMUTATIONS", 99)
    monkeypatch.setattr(conditioning_arm, "WINDOW_BLOCKS", (10, 11))
    for module in ("answer", "conditioning_page", "conditioning_figure"):
        monkeypatch.setattr(f"armlab.proof.open.conditioning.{module}.WINDOW_BLOCKS", (10, 11))


def test_windows_are_all_choices_of_blocks_and_a_permutation_exchanges_them() -> None:
    windows = RunWindows(2, blocks=3)
    assert windows.members.tolist() == [[0, 1], [0, 2], [1, 2]]
    assert windows.permuted(np.array([1, 2, 0])).tolist() == [2, 0, 1]
    assert windows.without(1).tolist() == [1]


def test_blocks_are_equally_long_and_hold_all_joints_of_a_sample() -> None:
    assert [rows.tolist() for rows in block_rows(samples=7, joints=2, blocks=3)] == [
        [0, 1, 2, 3],
        [4, 5, 6, 7],
        [8, 9, 10, 11],
    ]


def test_criteria_of_a_diagonal_matrix_by_hand() -> None:
    found = window_criteria(np.diag([8.0, 2.0, 0.5]), base=2, judged=np.eye(3))
    assert found["fitted_cond_si"] == pytest.approx(16.0)
    assert found["fitted_cond_unit"] == pytest.approx(1.0)
    assert found["fitted_d_optimality_si"] == pytest.approx(-2 * np.log(8.0) / 3)
    assert found["fitted_e_optimality_si"] == pytest.approx(-0.5)
    assert found["links_cond_si"] == pytest.approx(4.0)
    assert found["v_optimality"] == pytest.approx(1 / 64 + 1 / 4 + 4)


def test_v_optimality_is_the_power_of_the_predicted_error_under_white_noise() -> None:
    rng = np.random.default_rng(3)
    matrix, judged = rng.normal(size=(40, 5)), rng.normal(size=(30, 5))
    estimates = np.linalg.lstsq(matrix, rng.normal(size=(40, 20_000)), rcond=None)[0]
    power = np.mean(np.sum((judged @ estimates) ** 2, axis=0))
    triangle = np.asarray(np.linalg.qr(matrix, mode="r"))
    assert prediction_criterion(triangle, judged) == pytest.approx(power, rel=0.03)


def _block_sums(windows: RunWindows, rng: np.random.Generator) -> Array:
    """A quantity of each window to which every block adds its own part."""
    return np.exp(rng.normal(size=windows.blocks)[windows.members].sum(axis=1))


def test_unrelated_criteria_are_rarely_significant_though_windows_share_blocks(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(correlation, "PERMUTATIONS", 99)
    windows, rejected, held, naive = RunWindows(4), 0, 0, 0
    for seed in range(120):
        rng = np.random.default_rng(seed)
        criterion, error = _block_sums(windows, rng), _block_sums(windows, rng)
        found = correlate(windows, criterion[:, None], error, rng)
        rejected += found.p[0] <= 0.05
        held += found.low[0] <= 0 <= found.high[0]
        naive += spearmanr(criterion, error).pvalue <= 0.05
    assert rejected <= 12  # 6 are expected, more than 12 once in a hundred times
    assert held >= 108
    assert naive >= 80  # with windows as observations


def test_a_criterion_that_sorts_windows_as_their_errors_has_correlation_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(correlation, "PERMUTATIONS", 99)
    windows, rng = RunWindows(4), np.random.default_rng(0)
    error = _block_sums(windows, rng)
    found = correlate(windows, np.column_stack([error**3, -error, np.ones(len(error))]), error, rng)
    assert found.value[:2] == pytest.approx([1.0, -1.0])
    assert found.p[:2] == pytest.approx([0.01, 0.01])
    assert np.isnan(found.value[2])
    assert np.isnan(found.p[2])


def test_the_mean_over_arms_leaves_out_an_arm_without_a_value() -> None:
    def correlations(value: float) -> BlockCorrelation:
        each = np.array([value])
        return BlockCorrelation(each, 0 * each + 0.3, each, each, each, np.full((9, 1), 0.1 * value))

    mean = average([correlations(0.4), correlations(0.8), correlations(np.nan)], RunWindows(4))
    assert mean.value == pytest.approx([0.6])
    assert mean.error == pytest.approx([0.3 / np.sqrt(2)])
    assert mean.p == pytest.approx([0.1])
    assert np.isnan(average([correlations(np.nan)], RunWindows(4)).value[0])


@pytest.mark.parametrize("samples", [60, 61])
def test_simulated_noise_has_the_spectrum_of_what_the_fit_leaves(samples: int) -> None:
    rng = np.random.default_rng(5)
    data = Regression(rng.normal(size=(2 * samples, 4)), rng.normal(size=2 * samples), 2, (samples,), 100.0, 0.1)
    values = np.asarray(np.linalg.lstsq(data.matrix, data.torque, rcond=None)[0], dtype=np.float64)
    drawn = simulated_torques(data, values, simulations=3, rng=rng)
    noise = (drawn - (data.matrix @ values)[:, None]).T.reshape(3, samples, 2)
    raised = np.sqrt(2 * samples / (2 * samples - 4))
    expected = raised * np.abs(np.fft.rfft(data.residuals(values), axis=0))
    for each in noise:
        np.testing.assert_allclose(np.abs(np.fft.rfft(each, axis=0)), expected, atol=1e-9)
    assert not np.allclose(noise[0], noise[1])


@pytest.mark.usefixtures("small")
def test_the_whole_run_has_the_error_that_plain_identification_has(recording: Recording) -> None:
    found = study_arm(RECIPE, recording, simulations=20)
    model = Identifier(recording.arm, method="ordinary").fit(recording.with_role("identify")).model_
    judged = model.signals(recording.with_role("validate")[0])
    assert found.whole_error == pytest.approx(run_error(model, judged).relative_percent, rel=1e-6)
    assert [len(each.windows) for each in found.lengths] == [66, 12]
    for each in found.lengths:
        assert each.simulated.shape == (len(each.windows), 20)
        assert np.all(each.errors >= 0.9 * found.whole_error)
        assert list(each.criteria.columns) == list(CRITERIA)


def test_the_preferred_windows_are_those_with_the_least_criterion() -> None:
    errors = np.arange(10.0)
    length = ArmWindows(RunWindows(1, blocks=10), 1.0, pd.DataFrame(), errors, errors[:, None])
    assert median_of_preferred(length, -errors) == 9.0


@pytest.mark.parametrize(
    ("low", "high", "p", "word"),
    [
        (0.1, 0.7, 0.01, "helps"),
        (-0.7, -0.1, 0.01, "misleads"),
        (0.1, 0.7, 0.2, "cannot tell"),
        (-0.1, 0.7, 0.01, "cannot tell"),
        (np.nan, np.nan, np.nan, "cannot tell"),
    ],
)
def test_a_verdict_needs_a_small_p_and_an_interval_without_zero(low: float, high: float, p: float, word: str) -> None:
    assert verdict(low, high, p) == word


@pytest.mark.usefixtures("small")
def test_the_study_writes_page_tables_and_picture_and_logs_its_look(
    recording: Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(study, "open_public_recording", lambda name, folder: recording)
    lines = list(study.study_conditioning(tmp_path, tmp_path, ["emps"], lambda message: None))
    assert lines[0].startswith("**Windows of 10 of 12 blocks: ")
    written = {path.name for path in tmp_path.iterdir()}
    assert written >= {PAGE_NAME, TABLE_NAME, CHOICES_NAME, "conditioning.png"}
    table = pd.read_csv(tmp_path / TABLE_NAME)
    assert len(table) == 2 * 2 * len(CRITERIA)
    question = table[(table["arm"] == MEAN) & (table["criterion"] == "fitted_cond_si")].iloc[0]
    assert f"{question['correlation']:.2f} ({question['low']:.2f} to {question['high']:.2f}" in lines[0]
    looks = (tmp_path / "validation_looks.jsonl").read_text().splitlines()
    assert len(looks) == 1
    assert '"model": "conditioning"' in looks[0]


def test_an_unknown_arm_is_refused_in_one_line(tmp_path: Path) -> None:
    message = refusal(lambda: list(study.study_conditioning(tmp_path, tmp_path, ["ur10"], lambda message: None)))
    assert message.startswith("unknown arm 'ur10'")


@pytest.mark.usefixtures("small")
def test_a_window_has_the_error_and_the_condition_number_of_its_own_rows(recording: Recording) -> None:
    found = study_arm(RECIPE, recording, simulations=2).lengths[0]
    structure_, _, data = Identifier(recording.arm, method="ordinary").prepare(recording.with_role("identify"))
    rows = np.concatenate(block_rows(data.samples, data.joints)[:10])
    sizes = np.linalg.svd(data.matrix[rows], compute_uv=False)
    assert found.criteria["fitted_cond_si"].iloc[0] == pytest.approx(sizes[0] / sizes[-1], rel=1e-6)
    values = np.linalg.lstsq(data.matrix[rows], data.torque[rows], rcond=None)[0]
    model = TorqueModel("irb120-arm", structure_, values, cutoff_hz=1 / data.correlation_s)
    judged = model.signals(recording.with_role("validate")[0])
    assert found.errors[0] == pytest.approx(run_error(model, judged).relative_percent, rel=1e-6)
