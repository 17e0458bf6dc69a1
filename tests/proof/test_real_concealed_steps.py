"""Random cases of a real recording in steps of their own: made as files, diagnosed from them, judged by the answers."""

import json
import shutil
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from click.testing import CliRunner
from small_recordings import frame, recording_in
from small_reference import reference_in

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.identification.model_file import read_model
from armlab.proof.open.real_concealed import at_random
from armlab.proof.open.real_concealed.at_random import RandomCases, examine_observation, judge_cases, make_cases
from armlab.proof.open.real_concealed.conceal import ReferenceModel
from armlab.proof.open.real_concealed.concealed_case import Case, Disturbance, Piece
from armlab.proof.open.real_concealed.examine import conceal_case
from armlab.proof.open.real_concealed.observation import read_observation, write_observation
from armlab.proof.open.real_identification.looks import LOOKS_FILE
from armlab.recordings.public import LOCAL_COPIES_VARIABLE
from problem.robot_file import BUILT_IN_FOLDER

CASES = (
    Case("told"),
    Case("told", (Piece("friction", 2),)),
    Case("told", (), Disturbance("time_delay", None, 0.01, "s")),
)


@pytest.fixture(scope="module")
def reference(tmp_path_factory: pytest.TempPathFactory) -> ReferenceModel:
    return reference_in(tmp_path_factory.mktemp("recordings") / "told")


@pytest.mark.parametrize("case", CASES, ids=str)
def test_an_observation_is_to_the_bit_what_a_diagnosis_gets_in_memory(
    reference: ReferenceModel, case: Case, tmp_path: Path
) -> None:
    wanted = conceal_case(reference, case, tmp_path / "model.yaml")
    write_observation(reference, case, tmp_path / "seen")
    seen, source = read_observation(tmp_path / "seen")
    assert source == "told"
    assert (seen.findings, seen.arm.name, seen.sample_rate_hz) == (wanted.findings, wanted.arm.name, None)
    for own, other in zip(seen.runs, wanted.runs, strict=True):
        assert (own.name, own.role, own.findings, own.signals.keys()) == (
            other.name,
            other.role,
            other.findings,
            other.signals.keys(),
        )
        for name in ("time", *own.signals):
            np.testing.assert_array_equal(getattr(own, name), getattr(other, name))
    assert seen.simulation is not None
    assert seen.simulation.read_text() == (tmp_path / "model.yaml").read_text()


def test_an_observation_holds_neither_the_public_runs_nor_what_is_concealed(
    reference: ReferenceModel, tmp_path: Path
) -> None:
    write_observation(reference, CASES[2], tmp_path / "seen")
    files = {path.name for path in (tmp_path / "seen").iterdir()}
    assert files == {"recording.yaml", "reference.yaml", "runs.json", "run-1.npz", "run-2.npz"}
    notes = json.loads((tmp_path / "seen" / "runs.json").read_text())
    assert notes.keys() == {"source", "findings", "runs"}


def test_random_cases_are_made_diagnosed_and_judged(tmp_path: Path) -> None:
    recordings, settings, made = tmp_path / "recordings", RandomCases(("emps",), 1, 1001), tmp_path / "made"
    recording_in(recordings / "emps", frame(0, 6), frame(1, 6))
    list(make_cases(settings, recordings, tmp_path / "results", made, lambda message: None))
    looks = (tmp_path / "results" / LOOKS_FILE).read_text().splitlines()
    assert len(looks) == 2  # the validation run, with nothing concealed and with something
    for observation in (made / "observations").iterdir():
        list(examine_observation(observation, made / "verdicts" / observation.name))
    list(judge_cases(settings, made, tmp_path / "out"))
    assert {path.name for path in (tmp_path / "out").iterdir()} == {*at_random.TABLES, at_random.WEIGHED_FILE}
    assert pd.read_csv(tmp_path / "out" / "cases.csv")["refused"].isna().all()

    (made / "verdicts" / "emps-1" / "outcome.json").unlink()
    list(judge_cases(settings, made, tmp_path / "judged"))
    assert set(pd.read_csv(tmp_path / "judged" / "cases.csv")["refused"]) == {"no verdict"}
    with pytest.raises(InputError, match="holds no case of staubli-tx40"):
        list(judge_cases(RandomCases(("staubli-tx40",), 1, 1001), made, tmp_path / "judged"))


def test_a_folder_of_the_local_copies_is_a_case_with_its_own_robot_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The model that is handed over names the robot file beside it, wherever the command runs."""
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, str(tmp_path / "local"))
    mine = recording_in(tmp_path / "local" / "mine", frame(0, 6), frame(1, 6), robot="robot.yaml")
    shutil.copy(BUILT_IN_FOLDER / "irb120-arm.yaml", mine / "robot.yaml")
    settings, made = RandomCases(("mine",), 1, 1001), tmp_path / "made"
    list(make_cases(settings, tmp_path / "recordings", tmp_path / "results", made, lambda message: None))
    seen, source = read_observation(made / "observations" / "mine-1")
    assert source == "mine"
    assert seen.simulation is not None
    assert Path(read_model(seen.simulation).robot).resolve() == (made / "observations/mine-1/robot.yaml").resolve()


@pytest.mark.parametrize("name", ["emsp", "deep/mine", "none"])
def test_other_names_are_refused(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A folder has to stand directly below the local copies: its name is that of its cases."""
    monkeypatch.setenv(LOCAL_COPIES_VARIABLE, str(tmp_path))
    recording_in(tmp_path / "deep" / "mine", frame(0, 2))
    with pytest.raises(InputError, match=f"unknown recording '{name}'"):
        RandomCases((name,), 1, 1001)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--make", "a", "--judge", "b"], "give one of them"),
        (["--judge", "b"], "--seed is needed"),
        (["--seed", "1"], "give one of them"),
    ],
)
def test_steps_that_cannot_be_done_are_refused(options: list[str], complaint: str) -> None:
    refused = CliRunner().invoke(main, ["proof", "real-concealed", *options])
    assert refused.exit_code == 2
    assert complaint in refused.output
