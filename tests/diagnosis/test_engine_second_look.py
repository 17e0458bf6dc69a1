"""A model that a diagnosis wrote, as the simulation of the next diagnosis."""

from pathlib import Path

import pytest
import yaml
from small_recordings import POSSIBLE_PAYLOAD, frame, recording_in

from armlab.diagnosis.torque.diagnose import diagnose
from armlab.identification.model_file import read_model
from armlab.recordings.load import load_recording
from armlab.report.torque.write import diagnose_recording


@pytest.mark.parametrize("sampled", [False, True])
def test_nothing_is_missing_of_the_model_that_a_diagnosis_found(tmp_path: Path, sampled: bool) -> None:
    runs = [frame(seed, 6, mass=0.6, sampled=sampled, load=POSSIBLE_PAYLOAD) for seed in range(2)]
    folder = recording_in(tmp_path / "first", *runs)
    list(diagnose_recording(folder, tmp_path / "out", None, 0))
    _with_upright_base(tmp_path / "out" / "model.yaml")
    assert read_model(tmp_path / "out" / "model.yaml").effects[-1].candidate.effect == "base_tilt"
    content = yaml.safe_load((folder / "recording.yaml").read_text())
    (folder / "recording.yaml").write_text(yaml.safe_dump(content | {"simulation": "../out/model.yaml"}))
    again = diagnose(load_recording(folder))
    assert again.status == "none", again.claims


def _with_upright_base(path: Path) -> None:
    """Adds an effect that only the library can compute, and that changes nothing."""
    content = yaml.safe_load(path.read_text())
    gravity = {"value": [0.0, 0.0, -9.81], "ci95": None, "unit": "m/s2"}
    tilt = {"effect": "base_tilt", "joint": None, "joints": [], "parameters": {"gravity": gravity}}
    path.write_text(yaml.safe_dump(content | {"components": [*content["components"], tilt]}))
