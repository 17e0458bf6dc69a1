"""mujoco.sysid beside armlab on a small recording: one task for both, one judge, and a section of the page."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from refusals import refusal
from servo_arms import write_recording

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.diagnosis.motion.diagnose_motion import diagnose_motion
from armlab.diagnosis.motion.motion_result import MotionDiagnosis
from armlab.diagnosis.motion.motion_tuning import DEFAULT
from armlab.diagnosis.motion.replay import joint_rms
from armlab.diagnosis.motion.servo import place
from armlab.proof.open.motion.peer import WINDOWS, PeerComparison, compare_with_sysid, import_sysid, servo_task
from armlab.proof.open.motion.public_servos import peer_section
from armlab.recordings.motion import load_motion_recording

TRUTH = {"kp": 8.0, "kv": 0.0, "damping": 0.5, "frictionloss": 0.1, "delay": 0.02}
QUICK = replace(DEFAULT, coupling_rounds=1, max_step_error=1e3)  # numbers are chosen once, and the step stays


@pytest.fixture(scope="module")
def diagnosis(tmp_path_factory: pytest.TempPathFactory) -> MotionDiagnosis:
    folder = write_recording(tmp_path_factory.mktemp("peer") / "servo", TRUTH, seconds=12.0)
    return diagnose_motion(load_motion_recording(folder), tuning=QUICK)


@pytest.fixture(scope="module")
def comparison(diagnosis: MotionDiagnosis) -> PeerComparison:
    try:
        import_sysid()
    except InputError as error:
        pytest.skip(str(error))
    return compare_with_sysid(diagnosis, count=8)


def test_both_fit_the_numbers_of_the_diagnosis_from_the_simulation_on_the_windows_asked_for(
    diagnosis: MotionDiagnosis,
) -> None:
    task = servo_task(diagnosis, count=8)
    assert len(task.windows) == len(task.chosen) == 8 < len(task.stretches)
    assert {run.role for run in task.runs} == {"identify"}
    assert {run.role for run in task.held_out} == {"validate"}
    assert task.start.get("kp").tolist() == [60.0, 60.0]
    for row, chosen in enumerate(diagnosis.chosen):
        assert chosen is not None
        np.testing.assert_array_equal(task.free[row], chosen.fit.free)


def test_both_find_the_true_numbers_and_replay_alike(comparison: PeerComparison) -> None:
    for fit in (comparison.alone, comparison.peer):
        np.testing.assert_allclose(fit.servos.get("kp"), 8.0, rtol=0.1)
        np.testing.assert_allclose(fit.servos.get("friction"), 0.1, rtol=0.3)
        np.testing.assert_allclose(fit.servos.get("delay"), 0.02, atol=0.006)
        assert fit.seconds > 0
        assert fit.processor_seconds > 0
    held = ~comparison.task.free
    np.testing.assert_array_equal(comparison.peer.servos.values[held], comparison.task.start.values[held])
    assert joint_rms(comparison.peer.replayed).max() < 2 * joint_rms(comparison.alone.replayed).max()
    assert 0 < comparison.sysid.reached <= comparison.peer.seconds
    assert comparison.sysid.ended in ("norm(dx) < tol", "insufficient reduction", "maximum iterations reached")


def test_the_section_has_errors_times_their_ratios_and_each_free_number(comparison: PeerComparison) -> None:
    heading, words, errors, _, numbers = peer_section(comparison)
    assert heading == "### mujoco.sysid beside armlab"
    assert f"all {len(comparison.task.stretches)} windows" in words
    assert "8 of its windows" in words
    assert "| armlab, the same fit / mujoco.sysid | " in errors
    assert len(numbers.splitlines()) == 2 + int(comparison.task.free.sum())
    kp = comparison.peer.servos.values[0, place("kp")]
    assert f"| joint 1 | kp, N.m/rad | 60 | {comparison.diagnosis.servos.values[0, place('kp')]:.4g} | " in numbers
    assert f" | {kp:.4g} |" in numbers


def test_a_peer_without_its_packages_is_refused_with_the_extra_that_has_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr("mujoco.sysid.optimize", raising=False)
    assert "pip install 'armlab[peers]'" in refusal(import_sysid)


def test_windows_of_a_peer_that_is_not_asked_for_are_refused(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["proof", "real-motion", "--results", str(tmp_path), "--peer-windows", "3"])
    assert result.exit_code != 0
    assert "give both" in result.output
    assert f"[default: {WINDOWS}]" in CliRunner().invoke(main, ["proof", "real-motion", "--help"]).output
