"""Nothing is identified that cannot be: one gate, the same line from every command that fits or compares torques."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from recording_folders import IMPORT_OPTIONS, POSITION, SETTINGS, TORQUE, folder_with, frame
from refusals import refusal

from armlab.common.errors import DataError
from armlab.diagnosis.torque.carried_load import nominal_payload_lines
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.flows import identify
from armlab.identification.identifier import Identifier
from armlab.identification.identify import IdentifyOptions, identify_recording, predict_recording
from armlab.identification.payload import PayloadSetting, Place, gains_lines, payload_lines
from armlab.identification.torque_model import parameter_line
from armlab.identification.validation import error_table, run_error
from armlab.recordings.imports.files import import_files
from armlab.recordings.load import load_recording
from armlab.report.changes.comparison_report import compare_recordings

ALONE = {"runs": SETTINGS["runs"][:1]}
AS_READ = IdentifyOptions(as_read=True)
SETTING = PayloadSetting(Place())


def silent() -> pd.DataFrame:
    return frame().assign(**dict.fromkeys(TORQUE, 0.0))


def one_silent() -> pd.DataFrame:
    return frame().assign(tau2=0.0)


def constant() -> pd.DataFrame:
    return frame().assign(**dict.fromkeys(TORQUE, 1.5))


def copied() -> pd.DataFrame:
    table = frame()
    return table.assign(tau2=table["tau1"], tau3=table["tau1"])


def multiple() -> pd.DataFrame:
    table = frame()
    return table.assign(tau3=(-0.4 * table["tau2"]).round(8))


def of_motion() -> pd.DataFrame:
    table = frame()
    return table.assign(tau2=(1000 * table[POSITION[2]]).round(6))


def still() -> pd.DataFrame:
    table = frame()
    return table.assign(**{name: table[name].iloc[0] for name in POSITION})


def short() -> pd.DataFrame:
    return frame(seconds=0.3)


def far() -> pd.DataFrame:
    table = frame()
    table[POSITION] *= 1e4
    return table


def strong() -> pd.DataFrame:
    table = frame()
    table[TORQUE] *= 1e6
    return table


CASES = {
    silent: "is zero throughout: the driver does not fill it",
    constant: "never changes: is the right column named?",
    copied: "The torque of joints 1 and 2 is the same in every row",
    multiple: "The torque of joints 2 and 3 differs by the factor -0.4 in every row",
    of_motion: "The torque of joint 2 is 1000 times the position of joint 3 in every row",
    still: "No joint moves",
    short: "The runs hold 0.29 s in all: too short to tell physics from chance; record 10 s or more.",
}
IMPOSSIBLE = {
    far: "no arm is there. Which unit is it in?",
    strong: "more than any drive has. Which unit is it in?",
}
READS_UNITS = "payload"  # finds the unit of a torque, where the robot file stands for the arm without the load


def identified(folder: Path) -> Path:
    sound = folder_with(folder / "sound", frame(), ALONE)
    for _ in identify_recording(sound, folder / "model", AS_READ):
        pass
    return folder / "model" / "model.yaml"


def run_through(lines: object) -> None:
    for _ in lines:  # type: ignore[attr-defined]
        pass


def commands(bad: Path, folder: Path) -> dict[str, Callable[[], None]]:
    """What each command does with a recording."""
    sound = folder_with(folder / "sound", frame(2), ALONE)
    return {
        "identify": lambda: run_through(identify_recording(bad, folder / "out", AS_READ)),
        "identify --select": lambda: run_through(
            identify_recording(bad, folder / "out", IdentifyOptions(choose=True, as_read=True))
        ),
        "payload": lambda: run_through(nominal_payload_lines(bad, SETTING, lambda text: None)),
        "payload --without": lambda: run_through(payload_lines(sound, bad, SETTING)),
        "gains": lambda: run_through(gains_lines(bad, sound, 1.0, SETTING)),
        "compare": lambda: run_through(compare_recordings([bad, bad], folder / "compared", None, 0)),
    }


@pytest.mark.parametrize("made", CASES, ids=lambda made: made.__name__)
def test_every_command_refuses_what_tells_nothing_in_one_line(made: Callable[[], pd.DataFrame], tmp_path: Path) -> None:
    bad = folder_with(tmp_path / "bad", made(), ALONE)
    for name, act in commands(bad, tmp_path).items():
        assert CASES[made] in refusal(act), name
    diagnosis = diagnose(load_recording(bad))
    assert diagnosis.status == "inconclusive"
    assert CASES[made] in diagnosis.reason


def test_a_prediction_asks_for_torque_and_not_for_motion_or_length(tmp_path: Path) -> None:
    model = identified(tmp_path)
    for made in (silent, constant, copied):
        bad = folder_with(tmp_path / made.__name__, made(), ALONE)
        assert CASES[made] in refusal(run_through, predict_recording(model, bad, None))
    for made in (still, short):
        run_through(predict_recording(model, folder_with(tmp_path / made.__name__, made(), ALONE), None))


def test_a_joint_without_torque_in_one_of_two_recordings_is_a_change(tmp_path: Path) -> None:
    old, new = (folder_with(tmp_path / name, table, ALONE) for name, table in (("old", frame()), ("new", one_silent())))
    run_through(compare_recordings([old, new], tmp_path / "compared", None, 0))


@pytest.mark.parametrize("rows", [slice(None), slice(100, None), slice(None, None, -1)])
def test_a_copy_of_a_run_does_not_validate_it(tmp_path: Path, rows: slice) -> None:
    folder = folder_with(tmp_path, frame())
    frame().iloc[rows].to_csv(folder / "check.csv", index=False)
    said = refusal(run_through, identify_recording(folder, tmp_path / "out", AS_READ))
    assert "check.csv validates and holds rows of run.csv" in said


def test_a_torque_that_is_dead_in_the_run_that_validates_alone_judges_nothing(tmp_path: Path) -> None:
    model = identified(tmp_path)
    folder = folder_with(tmp_path / "bad", frame())
    frame(1).assign(tau2=0.0).to_csv(folder / "check.csv", index=False)
    acts = (
        lambda: run_through(identify_recording(folder, tmp_path / "out", AS_READ)),
        lambda: run_through(predict_recording(model, folder, None)),
    )
    for act in acts:
        assert "joint 2 never changes in check.csv, which validates" in refusal(act)


def test_fewer_independent_rows_than_unknowns_are_refused_with_both_numbers(tmp_path: Path) -> None:
    recording = load_recording(folder_with(tmp_path, frame(seconds=1.0), ALONE))
    with pytest.raises(DataError, match="independent rows below 1 Hz for 25 unknown numbers: record longer motion"):
        Identifier(recording.arm, cutoff_hz=1.0).fit(recording.runs)


def test_a_percentage_of_a_signal_without_power_is_a_dash(tmp_path: Path) -> None:
    recording = load_recording(folder_with(tmp_path, frame(), ALONE))
    model = Identifier(recording.arm, cutoff_hz=5.0).fit(recording.runs).model_
    dead = load_recording(folder_with(tmp_path / "dead", one_silent(), ALONE)).runs[0]
    row = error_table((run_error(model, model.signals(dead)),)).splitlines()[3].split()
    assert row[2] == "2"
    assert row[4] == "-"


def test_no_interval_of_no_width_is_printed(tmp_path: Path) -> None:
    """Torque of a simulation without noise, which the model explains to the last digit."""
    recording = load_recording(folder_with(tmp_path, frame(friction=0.0), ALONE))
    model = Identifier(recording.arm, cutoff_hz=5.0).fit(recording.runs).model_
    exact = recording.runs[0].with_signals(recording.runs[0].time, {"torque": model.predict(recording.runs[0])})
    fitted = Identifier(recording.arm, cutoff_hz=5.0).fit([exact]).model_
    for _, parameter in fitted.named_parameters():
        line = parameter_line(parameter)
        if "[" in line:
            low, high = line[line.index("[") + 1 : line.index("]")].split(", ")
            assert low != high
    assert np.isfinite(fitted.base_values).all()


@pytest.mark.parametrize("made", IMPOSSIBLE, ids=lambda made: made.__name__)
def test_every_command_refuses_numbers_that_no_arm_has_in_a_folder_written_by_hand(
    made: Callable[[], pd.DataFrame], tmp_path: Path
) -> None:
    bad, model = folder_with(tmp_path / "bad", made(), ALONE), identified(tmp_path)
    acts = commands(bad, tmp_path) | {"predict": lambda: run_through(predict_recording(model, bad, None))}
    for name, act in acts.items():
        if name != READS_UNITS:
            assert IMPOSSIBLE[made] in refusal(act), name
    recording = load_recording(bad)
    assert IMPOSSIBLE[made] in refusal(identify, recording, as_read=True)
    assert IMPOSSIBLE[made] in diagnose(recording, as_read=True).reason


def test_a_run_that_validates_is_asked_for_impossible_numbers_too(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "recording", frame())
    far().to_csv(folder / "check.csv", index=False)
    assert IMPOSSIBLE[far] in refusal(run_through, identify_recording(folder, tmp_path / "out", AS_READ))


def test_an_import_says_what_cannot_be_identified_from_what_it_writes(tmp_path: Path) -> None:
    said = {short: CASES[short], still: CASES[still], copied: CASES[copied]}
    for made, sentence in said.items():
        made().to_csv(tmp_path / "log.csv", index=False)
        options = {**IMPORT_OPTIONS, "units": ("position=rad", "torque=N.m")}
        imported = import_files([tmp_path / "log.csv"], tmp_path / made.__name__, options)
        assert any(sentence in line for line in imported.lines)
