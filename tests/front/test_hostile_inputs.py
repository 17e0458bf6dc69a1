"""Hostile inputs: one clear line with exit status 2, no traceback, nothing written."""

import errno
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from hostile_commands import EXPERIMENT, KINDS, LINK, Kind, read_outcomes, run_case
from refusals import refusal

from algorithms.contract import Box
from algorithms.driver import minimise
from algorithms.random_search import RandomSearch
from armlab.cli.main import main
from armlab.common.files import write_texts
from armlab.effects.example import write_example


def run_refused(folder: Path, *words: object) -> str:
    """The message of a command that refuses its input and writes nothing into a folder."""
    before = {path: path.lstat().st_mtime_ns for path in folder.rglob("*")}
    result = CliRunner().invoke(main, [str(word) for word in words])
    assert result.exception is None or isinstance(result.exception, SystemExit), repr(result.exception)
    assert result.exit_code == 2, result.output
    assert {path: path.lstat().st_mtime_ns for path in folder.rglob("*")} == before
    *_, line = result.stderr.strip().splitlines()
    return line


def write_yaml(path: Path, content: Any) -> Path:
    path.write_text(yaml.safe_dump(content))
    return path


def write_model(path: Path, **changes: Any) -> Path:
    base = {"schema": "model/1", "robot": "irb120-arm", "links": [LINK] * 3, "components": []}
    return write_yaml(path, base | changes)


def urdf(joints: int, mass: float = 1.0, name: str = "") -> str:
    parts = ['<robot name="r"><link name="l0"/>']
    for number in range(joints):
        parts.append(
            f'<link name="l{number + 1}"><inertial><mass value="{mass}"/>'
            '<inertia ixx=".1" iyy=".1" izz=".1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="{name or f"j{number}"}" type="revolute"><parent link="l{number}"/>'
            f'<child link="l{number + 1}"/><axis xyz="0 0 1"/></joint>'
        )
    return "".join(parts) + "</robot>"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("identify", "rec", "--tolerance", "nan"), "nan is not a finite number"),
        (("identify", "rec", "--cutoff-hz", "inf"), "inf is not a finite number"),
        (("payload", "rec", "--centre", "nan", "0", "0"), "nan is not a finite number"),
        (("model", "confusability", "irb120-arm", "rec", "--noise", "nan"), "nan is not a finite number"),
        (("next", "v.json", "--robot", "irb120-arm", "--duration", "nan"), "nan is not a finite number"),
        (("next", "v.json", "--robot", "irb120-arm", "--duration", "1e9"), "not in the range"),
        (("next", "v.json", "--robot", "irb120-arm", "--harmonics", "100000000"), "not in the range"),
        (("next", "v.json", "--robot", "irb120-arm", "--rate", "1e12"), "not in the range"),
        (("bench", "export", "p.yaml", "--record", "r", "--rate", "1e9", "--out", "x"), "not in the range"),
        (("diagnose", "rec", "--out", ""), "an empty name"),
    ],
)
def test_numbers_and_places_that_cannot_be_meant_are_refused_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    assert message in run_refused(tmp_path, *words)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (urdf(200), "has 200 moving joints; at most 16 are supported"),
        (urdf(3, mass=-1.37), "link 'l1': mass -1.37 should not be negative"),
        (urdf(3, mass=1e307), "link 1 has 1e+307"),
        (urdf(3, name="j"), "two joints are called 'j'"),
    ],
)
def test_robots_out_of_this_world_are_refused(tmp_path: Path, content: str, message: str) -> None:
    path = tmp_path / "arm.urdf"
    path.write_text(content)
    assert message in run_refused(tmp_path, "model", "base-parameters", path)


def test_a_model_of_a_joint_or_a_mass_that_cannot_be_is_not_exported(tmp_path: Path) -> None:
    parameters = {"coefficient": {"value": 1.0, "unit": "N.m.s/rad"}}
    component = {"effect": "viscous_friction", "joint": 99, "joints": [1], "parameters": parameters}
    path = write_model(tmp_path / "joint.yaml", components=[component])
    assert "joint 99 should be from 1 to 3" in run_refused(tmp_path, "model", "export", path, tmp_path / "x.xml")
    path = write_model(tmp_path / "mass.yaml", links=[LINK | {"mass": 1e307}, LINK, LINK])
    assert "link 1 has 1e+307" in run_refused(tmp_path, "model", "export", path, tmp_path / "x.xml")


def test_an_export_never_replaces_the_robot_that_the_model_is_made_from(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(urdf(3))
    path = write_model(tmp_path / "model.yaml", robot="arm.urdf")
    message = run_refused(tmp_path, "model", "export", path, tmp_path / "arm.urdf")
    assert "arm.urdf is there already: choose another name" in message


def test_a_verdict_that_is_nested_without_end_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "verdict.json"
    path.write_text("[" * 100_000)
    words = ("next", path, "--robot", "irb120-arm", "--out", tmp_path / "next")
    assert f"{path}: nested too deeply" in run_refused(tmp_path, *words)


def write_fifo(path: Path) -> None:
    os.mkfifo(path)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (write_fifo, "no regular file"),
        (lambda path: path.symlink_to("/dev/zero"), "no regular file"),
        (lambda path: path.write_text((",".join(["1"] * 20_000) + "\n") * 3), "20000 columns"),
        (lambda path: path.write_bytes(b""), "holds no rows of numbers"),
    ],
)
def test_files_that_never_end_or_are_too_wide_are_refused(
    tmp_path: Path, make: Callable[[Path], object], message: str
) -> None:
    make(tmp_path / "run.csv")
    words = ("recording", "import", tmp_path / "run.csv", "--robot", "irb120-arm", "--out", tmp_path / "new")
    assert message in run_refused(tmp_path, *words)


def test_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    assert run_refused(tmp_path, "identify", "x" * 10_000).endswith(": File name too long")


def test_a_separator_of_several_characters_is_refused(tmp_path: Path) -> None:
    (tmp_path / "run.csv").write_text("1,2\n3,4\n")
    words = ("recording", "import", tmp_path / "run.csv", "--separator", "banana", "--out", tmp_path / "new")
    assert "'banana' should be one character" in run_refused(tmp_path, *words)


@pytest.mark.parametrize(
    ("units", "message"),
    [
        (("time=s",), "--unit time=ns?"),
        (("time=ms",), "--unit time=ns?"),
        (("time=us",), "--unit time=ns?"),
        (("torque=A", "--gains", "1e6,1e6,1e6"), "--unit torque=mA?"),
    ],
)
def test_an_import_in_units_that_cannot_be_right_is_refused(
    tmp_path: Path, units: tuple[str, ...], message: str
) -> None:
    write_example(tmp_path / "log")
    files = tmp_path / "log" / "run-1.csv", "--robot", tmp_path / "log" / "robot.yaml"
    given = [word for each in units for word in (("--unit", each) if "=" in each else (each,))]
    assert message in run_refused(tmp_path, "recording", "import", *files, "--out", tmp_path / "new", *given)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"swarm_size": 10**9}, "of memory"),
        ({"swarm_size": 10**400}, "should be less than or equal to 1000000000"),
        ({"problem": [{"preset": "paper", "samples": 10**9}]}, "'samples'"),
        ({"problem": [{"preset": "joint-fourier", "harmonics": 10**7}]}, "'harmonics'"),
        ({"problem": []}, "should hold 1 or more entries"),
        ({"name": "a b"}, "should have the form"),
    ],
)
def test_experiments_that_no_machine_can_hold_are_refused_before_they_start(
    tmp_path: Path, change: dict[str, Any], message: str
) -> None:
    path = write_yaml(tmp_path / "mine.yaml", EXPERIMENT | change)
    assert message in run_refused(tmp_path, "run", path, "--results", tmp_path / "r", "--store", tmp_path / "s.sqlite")


QUICK_KINDS = [kind for kind in KINDS if kind.damaged in ("robot", "model", "experiment") and kind.command != "predict"]


@pytest.mark.parametrize("kind", QUICK_KINDS, ids=lambda kind: kind.name)
@pytest.mark.parametrize("seed", range(100))
def test_a_damaged_file_is_used_or_refused_in_one_line(
    kind: Kind, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Outcomes of the seeds: exit 0 with finite numbers alone, or exit 2 with one line; never a traceback."""
    monkeypatch.chdir(tmp_path)
    outcome = run_case(kind, seed, tmp_path)
    assert outcome.verdict in ("used", "refused"), outcome


def test_the_list_of_outcomes_has_every_case_of_the_generator_and_no_broken_one() -> None:
    listed = read_outcomes()
    assert [each.case for each in listed] == [f"{kind.name}/{seed}" for kind in KINDS for seed in range(kind.seeds)]
    assert [each for each in listed if each.verdict not in ("used", "refused")] == []


SLOW_KINDS = [kind for kind in KINDS if kind not in QUICK_KINDS and not kind.command.startswith("next")]


SLOW_CASES = [(kind, seed) for kind in SLOW_KINDS for seed in range(min(kind.seeds, 2))]


@pytest.mark.parametrize(("kind", "seed"), SLOW_CASES, ids=lambda part: getattr(part, "name", str(part)))
def test_a_command_does_with_damaged_input_what_the_list_says(
    kind: Kind, seed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    outcome = run_case(kind, seed, tmp_path)
    listed = next(each for each in read_outcomes() if each.case == outcome.case)
    assert (outcome.exit_status, outcome.verdict) == (listed.exit_status, listed.verdict), outcome


def test_a_full_disk_leaves_nothing_half_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The third file of a folder finds no space left."""
    written = list[Path]()

    def write_bytes(path: Path, data: bytes) -> int:
        written.append(path)
        if len(written) == 3:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        with path.open("wb") as file:
            return file.write(data)

    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "a").write_text("kept")
    monkeypatch.setattr(Path, "write_bytes", write_bytes)
    for folder in ("new", "old"):
        written.clear()
        message = str(refusal(write_texts, {"a": "1", "b/c": "2", "d": "3"}, tmp_path / folder))
        assert message == f"cannot write into {tmp_path / folder}: No space left on device"
    assert [str(path.relative_to(tmp_path)) for path in sorted(tmp_path.rglob("*"))] == ["old", "old/a"]
    assert (tmp_path / "old" / "a").read_text() == "kept"


def test_a_time_that_stands_still_is_refused_by_the_check(tmp_path: Path) -> None:
    folder = tmp_path / "arm"
    folder.mkdir()
    columns = {"time": "t", "position": ["q1", "q2", "q3"], "torque": ["u1", "u2", "u3"]}
    settings = {"schema": "recording/1", "robot": "irb120-arm", "columns": columns, "units": {}}
    write_yaml(folder / "recording.yaml", settings | {"runs": [{"file": "run.csv"}]})
    rows = "".join(f"1.0,{n % 7},{n % 5},{n % 3},{n % 11},{n % 13},{n % 17}\n" for n in range(200))
    (folder / "run.csv").write_text("t,q1,q2,q3,u1,u2,u3\n" + rows)
    message = run_refused(tmp_path, "identify", folder)
    assert "run.csv: the time stands still at 1 s" in message


def test_an_output_folder_that_is_a_file_is_refused(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("kept")
    assert "cannot write into" in str(refusal(write_texts, {"a": "1"}, tmp_path / "file"))
    assert (tmp_path / "file").read_text() == "kept"


class Scribbler(RandomSearch):
    """Writes into what it is told."""

    @staticmethod
    def tell(state: Any, X: Any, fitness: Any) -> Any:
        told = RandomSearch.tell(state, X, fitness)
        X[:], fitness[:] = 0.0, 0.0
        return told


def test_an_algorithm_that_writes_into_what_it_is_told_changes_no_result() -> None:
    box = Box(np.full(2, -1.0), np.full(2, 1.0))
    first = np.random.default_rng(0).uniform(-1, 1, (5, 2))

    def square(points: Any) -> Any:
        return np.sum(points**2, axis=1)

    def best(algorithm: Any) -> float:
        points = first.copy()
        rng = np.random.default_rng(1)
        return minimise(
            algorithm, algorithm.Params(), lambda X: np.sum(X**2, axis=1), box, points, 50, rng
        ).best_fitness

    assert best(Scribbler) == best(RandomSearch) > 0


@pytest.mark.parametrize("command", [["conceal"], ["proof", "run"], ["proof", "ablate"]])
def test_no_processes_are_refused(command: list[str], tmp_path: Path) -> None:
    result = CliRunner().invoke(main, [*command, "--jobs", "0"])
    assert result.exit_code == 2
    assert "0 processes do nothing" in result.output


def test_ctrl_c_ends_any_command_with_one_line(monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("bench.studies.best_known.search.improve_best_known", interrupted)
    result = CliRunner().invoke(main, ["bench", "best-known"])
    assert (result.exit_code, result.stdout, result.stderr) == (130, "", "armlab: stopped\n")
