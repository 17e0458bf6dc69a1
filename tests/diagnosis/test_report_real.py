"""`diagnosis.md` of real arms, on recordings that stand in for them."""

import json
from pathlib import Path

import numpy as np
import pytest
from told_recordings import frame, recording_in

from armlab.diagnosis.real_arms import diagnose_public_recordings, mass_agreement, study_recording
from armlab.effects.parameters import ParameterValue
from armlab.identification.real.looks import Looks


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("recordings")
    recording_in(folder / "kuka-kr300", frame(0, 6, mass=0.4), frame(1, 6, mass=0.4))
    return folder


def test_the_page_tells_findings_gains_and_what_each_run_says_alone_and_every_look_is_logged(
    recordings: Path, tmp_path: Path
) -> None:
    lines = list(diagnose_public_recordings(tmp_path, recordings, ("kuka-kr300",)))
    page = (tmp_path / "diagnosis.md").read_text()
    assert lines[-1] == str(tmp_path / "diagnosis.md")
    assert "## kuka-kr300" in page
    assert "| viscous friction | joint 2 |" in page
    assert "| run-1.csv | " in page
    assert "- run-0.csv: " in page
    assert "- run-1.csv: " in page
    looks = [json.loads(line) for line in (tmp_path / "validation_looks.jsonl").read_text().splitlines()]
    assert [(each["run"], each["model"]) for each in looks] == [("run-1.csv", "diagnosis")]


def test_gains_are_percent_of_the_torque_of_the_run_that_took_no_part(recordings: Path, tmp_path: Path) -> None:
    found = study_recording("kuka-kr300", recordings, Looks(tmp_path / "looks.jsonl"), lambda message: None)
    (gain,) = found.gains
    assert gain.run == "run-1.csv"
    observed = found.diagnosis.observed
    assert observed is not None
    (held,) = observed.of_role("validate")
    torque = observed.torque[held.start : held.stop]
    assert found.diagnosis.final is not None
    left = found.diagnosis.final[held.start : held.stop]
    assert gain.found == pytest.approx(100 * np.sqrt(np.sum(left**2) / np.sum(torque**2)))
    assert gain.given is not None
    assert gain.given > gain.refitted > 5 * gain.found


def test_recordings_that_were_not_asked_for_are_left_alone(recordings: Path, tmp_path: Path) -> None:
    assert list(diagnose_public_recordings(tmp_path, recordings, ("unisa-panda",))) == []
    assert list(tmp_path.iterdir()) == []


def test_masses_agree_where_their_intervals_allow_one_mass() -> None:
    def mass(value: float, half: float) -> ParameterValue:
        return ParameterValue("mass", value, (value - half, value + half), "kg")

    assert "they agree" in mass_agreement([mass(150.0, 10.0), mass(155.0, 10.0), mass(149.0, 8.0)])
    assert "they do not agree" in mass_agreement([mass(100.0, 10.0), mass(180.0, 10.0)])
    assert "Too few" in mass_agreement([mass(100.0, 10.0)])
