"""Other formats: what is in them arrives unchanged, under names that a person can choose from."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from gripper_robots import GRIPPER_URDF
from joint_state_bags import write_bag
from numpy.testing import assert_allclose, assert_array_equal
from odd_logs import coarse, in_turn, thinned
from recording_folders import POSITION, TORQUE, frame
from refusals import refusal
from scipy.io import savemat

from armlab.recordings.imports.files import import_files
from armlab.recordings.imports.matlab import read_mat
from armlab.recordings.imports.plan import plan_import
from armlab.recordings.imports.ros import read_bag
from armlab.recordings.imports.text import read_odd_csv
from armlab.recordings.load import load_recording
from problem.locked_joints import read_lock_record

OPTIONS = {
    "robot": "irb120-arm",
    "time": "t",
    "position": "q1,q2,q3",
    "torque": "tau?",
    "units": ("time=s", "position=rad", "torque=Nm"),
    "gains": None,
    "validate": (),
    "separator": None,
    "decimal": None,
    "topic": None,
}


def odd_text(separator: str = ",", decimal: str = ".", header: str | None = "t q1 q2 q3 tau1 tau2 tau3") -> str:
    table = frame()
    lines = [separator.join(f"{value:.9g}".replace(".", decimal) for value in row) for row in table.to_numpy()]
    top = [header.replace(" ", separator)] if header else []
    return "\n".join([*top, *lines, ""])


@pytest.mark.parametrize(
    ("separator", "decimal"), [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), ("  ", ",")]
)
@pytest.mark.parametrize("header", [None, "t q1 q2 q3 tau1 tau2 tau3"])
def test_separator_and_decimal_sign_are_found_in_the_file(
    tmp_path: Path, separator: str, decimal: str, header: str | None
) -> None:
    path = tmp_path / "log.txt"
    path.write_text(odd_text(separator, decimal, header))
    table = read_odd_csv(path).table
    assert table.names == (tuple(header.split()) if header else tuple(f"c{n}" for n in range(1, 8)))
    assert_allclose(table.values, frame(), rtol=1e-8)


@pytest.mark.parametrize(
    "top",
    [
        "t;q1;q2;q3;tau1;tau2;tau3\n[s];[deg];[deg];[deg];[Nm];[Nm];[Nm]",
        "t [s];q1 [deg];q2 [deg];q3 [deg];tau1 (Nm);tau2 (Nm);tau3 (Nm)",
        "% logged by the controller\n# t [s];q1 [deg];q2 [deg];q3 [deg];tau1 [Nm];tau2 [Nm];tau3 [Nm]",
    ],
)
def test_units_are_read_from_the_header_or_the_row_below(tmp_path: Path, top: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(top + "\n" + odd_text(";", ",", None))
    import_files([path], tmp_path / "new", {**OPTIONS, "units": ()})
    run = load_recording(tmp_path / "new").runs[0]
    assert_allclose(run.position, np.deg2rad(frame()[POSITION]), rtol=1e-8)
    assert_allclose(run.torque, frame()[TORQUE], rtol=1e-8)


def test_numbers_in_a_comment_are_no_measurement(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("# 1,2,3,4,5,6,7\n" + odd_text())
    assert len(read_odd_csv(path).table.values) == len(frame())


@pytest.mark.parametrize(("place", "cell"), [(3, ""), (3, "nan"), (7, ""), (7, "NaN")])
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_column_without_numbers_is_no_signal(tmp_path: Path, separator: str, place: int, cell: str) -> None:
    rows = [line.split(separator) for line in odd_text(separator).splitlines()]
    for number, row in enumerate(rows):
        row.insert(place, cell if number else "hollow")
    path = tmp_path / "log.csv"
    path.write_text("\n".join(map(separator.join, rows)) + "\n")
    table = read_odd_csv(path).table
    assert table.empty == ("hollow",)
    assert_allclose(table.columns([name for name in table.names if name != "hollow"], "all"), frame(), rtol=1e-8)
    lines = import_files([path], tmp_path / "new", OPTIONS).lines
    assert "no signal, without any number: hollow" in lines[0]


def test_a_separator_at_the_end_of_each_line_is_no_column(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text(";").replace("\n", ";\n"))
    assert read_odd_csv(path).table.names == ("t", "q1", "q2", "q3", "tau1", "tau2", "tau3")


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ("q1,q2,q3", "column q2 (position) is empty: it has no number in any row"),
        ("q?", "--position q? names 2 columns (q1, q3; no number is in q2); the robot has 3 joints"),
        ("q2*", "--position q2* names 0 columns (none; no number is in q2); the robot has 3 joints"),
    ],
)
def test_a_chosen_column_without_numbers_is_refused_in_one_line(tmp_path: Path, given: str, message: str) -> None:
    path = tmp_path / "log.csv"
    frame().assign(q2="").to_csv(path, index=False)
    assert message in refusal(import_files, [path], tmp_path / "new", {**OPTIONS, "position": given})


def test_a_cut_last_row_of_an_odd_file_is_left_out_and_said_so(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text() + "9.9,0.1")
    lines = import_files([path], tmp_path / "new", OPTIONS).lines
    assert "the last row (line 1602) has 2 cells of 7; left out" in lines[0]


def test_matlab_matrices_become_columns_whichever_way_they_lie(tmp_path: Path) -> None:
    table = frame()
    content = {
        "rec": {"q": table[POSITION].to_numpy().T, "tau": table[TORQUE].to_numpy()},
        "t": table["t"].to_numpy()[:, None],
        "gain": 3.0,
        "label": "run A",
    }
    path = tmp_path / "log.mat"
    savemat(path, content)
    found = read_mat(path)
    assert set(found.names) == {"t", *(f"rec.{name}_{n}" for name in ("q", "tau") for n in (1, 2, 3))}
    options = {**OPTIONS, "position": "rec.q_*", "torque": "rec.tau_*"}
    import_files([path], tmp_path / "new", options)
    run = load_recording(tmp_path / "new").runs[0]
    assert_array_equal(run.position, table[POSITION])
    assert_array_equal(run.torque, table[TORQUE])


@pytest.mark.parametrize("storage", ["sqlite3", "mcap"])
@pytest.mark.parametrize("whole", [False, True])
def test_a_bag_of_joint_states_arrives_joint_by_joint(tmp_path: Path, storage: str, whole: bool) -> None:
    file = write_bag(tmp_path / "bag", storage, frame())
    options = {**OPTIONS, "position": "position_j1,position_j2,position_j3", "units": ()}
    options["torque"] = "effort_j1,effort_j2,effort_j3"
    import_files([file.parent if whole else file], tmp_path / "new", options)
    run = load_recording(tmp_path / "new").runs[0]
    assert_array_equal(run.position, frame()[POSITION])
    assert_array_equal(run.torque, frame()[TORQUE])
    assert_allclose(run.time, frame()["t"], atol=1e-9)


@pytest.mark.parametrize("suffix", [".db3", ".mcap", ".bag"])
@pytest.mark.parametrize(
    "content", [b"", b"garbage" * 50, b"\x89MCAP0\r\n" + b"x" * 99, b"SQLite format 3\0" + b"y" * 99]
)
def test_what_is_no_bag_is_refused_in_one_line(tmp_path: Path, suffix: str, content: bytes) -> None:
    pytest.importorskip("rosbags")
    path = tmp_path / f"log{suffix}"
    path.write_bytes(content)
    assert "cannot read" in refusal(read_bag, path)


def test_a_truncated_mcap_file_is_refused_in_one_line(tmp_path: Path) -> None:
    file = write_bag(tmp_path / "bag", "mcap", frame())
    file.write_bytes(file.read_bytes()[:5000])
    assert "cannot read" in refusal(read_bag, file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"robot": None}, "the robot is missing: give --robot"),
        ({"robot": "irb130"}, "unknown robot"),
        ({"position": "q1,q2,q4"}, "no column 'q4' for position: known: t, q1, q2"),
        ({"units": ("time=s", "torque=Nm")}, "no unit is known for position: give --unit position=UNIT"),
        ({"units": ("position=degre",)}, "unknown unit 'degre' of position: did you mean 'deg'?"),
        ({"units": ("deg",)}, "should be SIGNAL=UNIT"),
        ({"units": ("position=mm",)}, "--unit position=mm does not fit joints that are revolute: give one of rad, deg"),
        ({"gains": "1,nan,1"}, "--gains 1,nan,1 should be numbers from -1e+06 to 1e+06"),
        ({"position": "q1,q1,q2"}, "--position q1,q1,q2 names column q1 twice"),
        ({"gains": "1,x"}, "--gains 1,x should be numbers"),
        ({"validate": ("b.csv",)}, "--validate b.csv should be one of the imported files"),
        ({"separator": ";", "decimal": ","}, "holds no rows of numbers"),
    ],
)
def test_each_mistake_in_the_options_is_told_in_one_line(tmp_path: Path, change: dict, message: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    assert message in refusal(import_files, [path], tmp_path / "new", {**OPTIONS, **change})
    assert not (tmp_path / "new").exists()


def test_questions_come_with_a_proposal_from_names_and_values(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    nothing = {**dict.fromkeys(OPTIONS), "units": (), "validate": ()}
    plan = plan_import([path], {**nothing, "robot": "irb120-arm"})
    asked = [(question.option, question.signal, question.proposal) for question in plan.questions]
    assert asked == [("units", "position", "rad"), ("units", "torque", "N.m"), ("out", None, "log-recording")]
    assert plan_import([path], nothing).questions[0].option == "robot"


def test_a_folder_that_holds_something_is_never_written_over(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    assert "choose a new folder" in refusal(import_files, [path], tmp_path, OPTIONS)


@pytest.mark.parametrize("name", ["log.xlsx", "absent.csv"])
def test_a_file_of_no_known_format_is_refused(tmp_path: Path, name: str) -> None:
    (tmp_path / "log.xlsx").write_text("x")
    assert name in refusal(import_files, [tmp_path / name], tmp_path / "new", OPTIONS)


def test_a_recording_of_a_robot_with_a_gripper_holds_a_robot_file_of_its_arm(tmp_path: Path) -> None:
    (tmp_path / "toy.urdf").write_text(GRIPPER_URDF)
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    options = {**OPTIONS, "robot": str(tmp_path / "toy.urdf")}
    assert "locked: hand (3 joints)" in refusal(import_files, [path], tmp_path / "recording", options)
    imported = import_files([path], tmp_path / "recording", {**options, "tip": "hand", "lock": ("finger1=0.02",)})
    assert any("locked: finger1 at 0.02, finger2 at 0.4" in line for line in imported.lines)
    whole = tmp_path / "recording" / "whole-toy.urdf"
    assert f"{whole}: the whole robot, for `armlab model export`" in imported.lines
    assert imported.document["whole_robot"] == whole
    shutil.move(tmp_path / "recording", tmp_path / "elsewhere")
    (tmp_path / "toy.urdf").unlink()
    assert [joint.name for joint in load_recording(tmp_path / "elsewhere").arm.joints] == ["joint1", "joint2", "joint3"]
    record = read_lock_record(tmp_path / "elsewhere" / "toy.urdf")
    assert record is not None
    assert record.original.read_text() == GRIPPER_URDF


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"robot": "irb120-arm", "tip": "hand"}, "irb120-arm is built in, as one chain of joints"),
        ({"robot": None, "lock": ("finger1=0",)}, "--tip, --lock and --repair belong to a robot file"),
        ({"robot": "arm.yaml", "tip": "hand"}, "only joints of a URDF or MJCF (.xml) file can be locked"),
    ],
)
def test_a_tip_needs_a_robot_file_with_links(tmp_path: Path, given: dict[str, object], message: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    assert message in refusal(import_files, [path], tmp_path / "recording", {**OPTIONS, **given})


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda rows: rows[:5], "at least"),
    ],
    ids=["five rows"],
)
def test_a_log_that_no_command_could_use_is_not_imported(
    tmp_path: Path, spoil: Callable[[list[str]], list[str]], message: str
) -> None:
    head, *rows = odd_text().splitlines()
    path = tmp_path / "log.csv"
    path.write_text("\n".join([head, *spoil(rows), ""]))
    told = refusal(import_files, [path], tmp_path / "recording", OPTIONS)
    assert told.startswith("nothing is written: log.csv")
    assert message in told
    assert not (tmp_path / "recording").exists()


def test_rows_without_a_stamp_are_left_out_of_signals_in_rows_of_their_own_and_said_so(tmp_path: Path) -> None:
    rows = in_turn(frame())
    path = tmp_path / "log.csv"
    rows.assign(t=rows["t"].where(np.arange(len(rows)) % 3 > 0)).to_csv(path, index=False)
    given = {**OPTIONS, "time": "t", "position": "q*", "torque": "tau*"}
    (source,) = plan_import([path], {**given, "out": tmp_path / "recording"}).sources.values()
    (note,) = [each.text for each in source.table.findings if each.kind == "several_rates"]
    assert f"; {-(-len(rows) // 3)} rows have no stamp and are left out" in note
    import_files([path], tmp_path / "recording", given)
    (run,) = load_recording(tmp_path / "recording").runs
    wanted = np.searchsorted(rows["t"], run.time - 1e-9)
    assert_array_equal(run.torque, rows[list(TORQUE)].to_numpy()[wanted])
    assert_allclose(run.position, frame()[list(POSITION)].to_numpy()[wanted], atol=1e-3)


def test_columns_of_another_order_than_the_positions_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    for signal, names in (("torque", "tau2,tau1,tau3"), ("position", "q2,q1,q3")):
        told = refusal(import_files, [path], tmp_path / "recording", {**OPTIONS, signal: names})
        assert "the columns of a joint should stand at one place in both" in told
    both = {**OPTIONS, "torque": "tau2,tau1,tau3", "position": "q2,q1,q3"}
    assert import_files([path], tmp_path / "recording", both).plan.columns["position"] == ("q2", "q1", "q3")


def test_a_refused_import_keeps_the_folder_that_the_user_works_in(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "log.csv"
    path.write_text("\n".join(odd_text().splitlines()[:4]) + "\n")  # too short for a recording
    (tmp_path / "new").mkdir()
    monkeypatch.chdir(tmp_path / "new")
    assert "nothing is written: " in refusal(import_files, [path], Path(), OPTIONS)
    assert list((tmp_path / "new").iterdir()) == []


def test_gains_of_a_torque_that_needs_none_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(odd_text())
    told = refusal(import_files, [path], tmp_path / "new", {**OPTIONS, "gains": "1,1,1"})
    assert told == "--gains are N.m per A or V, and the torque is in N.m: leave them out, or give --unit torque=A"


def test_a_pattern_that_fits_nothing_is_told_though_another_fits_an_empty_column(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    frame().assign(q2="").to_csv(path, index=False)
    told = refusal(import_files, [path], tmp_path / "new", {**OPTIONS, "position": "q?,p*"})
    assert told.startswith("no column 'p*' for position")


@pytest.mark.parametrize(
    ("rate_hz", "lost", "is_coarse"),
    [(200.0, 0.05, False), (200.0, 0.33, False), (300.0, 0.05, True), (300.0, 0.33, True)],
)
def test_a_clock_is_called_coarse_where_rows_come_unevenly_in_its_steps_and_not_where_rows_of_an_even_one_are_lost(
    rate_hz: float, lost: float, is_coarse: bool, tmp_path: Path
) -> None:
    coarse(thinned(in_turn(frame()), lost), rate_hz).to_csv(tmp_path / "log.csv", index=False)
    (source,) = plan_import([tmp_path / "log.csv"], {**OPTIONS, "out": tmp_path / "new"}).sources.values()
    said = [each.text for each in source.table.findings if each.kind == "coarse_stamps"]
    assert len(said) == is_coarse
    assert all("known to 1.67 ms" in each for each in said)
