"""`armlab recording`: import, check and fetch, as a person types them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from recording_folders import folder_with, frame
from refusals import refusal

from armlab.cli.main import main
from armlab.recordings.load import load_recording
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_copies


def call(*words: object) -> Result:
    return CliRunner().invoke(main, ["recording", *(str(word) for word in words)])


def test_check_prints_each_finding_in_a_line_and_writes_one_page_with_pictures(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "arm", frame().drop(index=range(600, 700)))
    result = call("check", folder, "--out", tmp_path / "page.html")
    assert result.exit_code == 0
    assert "run.csv part 1: repaired: 1 gap(s)" in result.output
    page = (tmp_path / "page.html").read_text()
    assert page.count("data:image/png;base64,") >= 4
    assert "cut into 2 parts" in page
    assert "http" not in page.split("</style>")[1]


def test_check_of_a_sound_recording_says_so(tmp_path: Path) -> None:
    result = call("check", folder_with(tmp_path / "arm", frame()), "--out", tmp_path / "page.html")
    assert "nothing was repaired and nothing looks wrong" in result.output


@pytest.mark.parametrize("name", ["page", "page.txt", "."])
def test_a_page_without_the_ending_of_a_page_is_refused(tmp_path: Path, name: str) -> None:
    result = call("check", folder_with(tmp_path / "arm", frame()), "--out", tmp_path / name)
    assert result.exit_code == 2
    assert "should end with .html" in " ".join(result.output.split())
    assert [path.name for path in tmp_path.iterdir()] == ["arm"]


def test_check_of_a_recording_with_an_unusable_run_ends_with_an_error_after_the_page(tmp_path: Path) -> None:
    folder = folder_with(tmp_path / "arm", "t,q1\n")
    result = call("check", folder, "--out", tmp_path / "page.html")
    assert result.exit_code == 2
    assert "1 of the run files of" in result.stderr
    assert "run.csv: refused:" in result.output
    assert (tmp_path / "page.html").is_file()


def test_names_in_the_data_cannot_break_the_page(tmp_path: Path) -> None:
    runs = [{"file": "<b>.csv"}, {"file": "check.csv"}, {"file": "<i>absent.csv"}]
    folder = folder_with(tmp_path / "arm", frame(), {"runs": runs})
    (folder / "run.csv").rename(folder / "<b>.csv")
    call("check", folder, "--out", tmp_path / "page.html")
    page = (tmp_path / "page.html").read_text()
    assert "&lt;b&gt;.csv" in page
    assert "&lt;i&gt;absent.csv" in page
    assert "<b>" not in page
    assert "<i>" not in page


def test_import_by_flags_gives_a_recording_that_loads(tmp_path: Path) -> None:
    frame().to_csv(tmp_path / "a.csv", index=False, sep=";")
    frame(1).to_csv(tmp_path / "b.csv", index=False, sep=";")
    words = [
        "import",
        tmp_path / "a.csv",
        tmp_path / "b.csv",
        "--validate",
        tmp_path / "b.csv",
        "--out",
        tmp_path / "new",
    ]
    words += ["--robot", "irb120-arm", "--time", "t", "--position", "q*", "--torque", "tau*"]
    result = call(*words, "--unit", "time=s", "--unit", "position=rad", "--unit", "torque=N.m")
    assert result.exit_code == 0
    assert [run.role for run in load_recording(tmp_path / "new").runs] == ["identify", "validate"]


def test_a_log_in_the_place_of_a_recording_is_refused_with_what_makes_one_of_it(tmp_path: Path) -> None:
    log = tmp_path / "log.csv"
    log.write_text("t,q1\n")
    assert f"{log} is a file: `armlab recording import {log} --out FOLDER`" in refusal(load_recording, log)


@pytest.mark.skipif(local_copies() is None, reason=f"{LOCAL_COPIES_VARIABLE} names no local copies")
def test_fetch_names_source_and_licence(tmp_path: Path) -> None:
    result = call("fetch", "emps", "--out", tmp_path / "emps")
    assert "forgi86/sysid-neural-continuous, licence Apache-2.0" in result.output
    assert load_recording(tmp_path / "emps").arm.joints[0].kind == "prismatic"


def test_the_commands_import_nothing_heavy_before_they_run() -> None:
    code = (
        "import sys, armlab.cli.recording; print(sorted({'numpy', 'scipy', 'matplotlib', 'pandas'} & set(sys.modules)))"
    )
    path = os.pathsep.join(sys.path)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, env={**os.environ, "PYTHONPATH": path}
    )
    assert done.stdout.strip() == "[]"
