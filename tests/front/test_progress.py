"""Long commands show what they do, for how long, and the time left."""

import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import pytest
from click.testing import CliRunner
from servo_arms import write_recording
from small_recordings import frame, recording_in

from armlab.cli import progress as shown
from armlab.cli.commands import CommandTable
from armlab.cli.main import main
from armlab.cli.output import prints_lines, tell_progress
from armlab.cli.progress import Progress, in_time_words
from armlab.cli.step_shares import SHARES, USUAL_S

# Commands that run no longer than two seconds, or print all along what they do.
WITHOUT_PROGRESS = {"recording example", "tools regression", "tools scale"}


def commands_of(group: CommandTable, context: click.Context, before: str = "") -> Iterator[tuple[str, click.Command]]:
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        assert command is not None
        if isinstance(command, CommandTable):
            yield from commands_of(command, context, f"{name} ")
        else:
            yield f"{before}{name}", command


def all_commands() -> dict[str, click.Command]:
    assert isinstance(main, CommandTable)
    return dict(commands_of(main, click.Context(main)))


def test_every_command_shows_each_second_what_it_does_or_is_listed_as_one_without() -> None:
    silent = {name for name, each in all_commands().items() if "quiet" not in {given.name for given in each.params}}
    assert silent == WITHOUT_PROGRESS


def test_the_times_of_steps_are_those_of_commands() -> None:
    names = {name.partition(": ")[0] for name in (*USUAL_S, *SHARES)}
    assert names <= set(all_commands())
    assert set(SHARES) <= set(USUAL_S)
    assert {"recording check", "diagnose", "identify", "payload", "next", "model confusability"} <= names
    assert all(0 <= share <= 1 for shares in SHARES.values() for share in shares.values())


def progress_of(monkeypatch: pytest.MonkeyPatch, command: str, seconds: list[float]) -> Progress:
    """A progress whose clock shows the first of the seconds; a test changes it."""
    monkeypatch.setattr(shown, "USUAL_S", {"work": 40.0, "work: first step": 60.0})
    monkeypatch.setattr(shown, "SHARES", {"work: first step": {"first step": 0.0, "round #": 0.5, "last step": 0.9}})
    return Progress(command, quiet=False, clock=lambda: seconds[0])


def test_the_time_left_follows_from_the_share_that_usually_has_passed(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    progress = progress_of(monkeypatch, "work", now)
    assert progress.line() == "work ..."
    now[0] = 10.0
    assert progress.line() == "work ... 10 s, about 30 s left"
    progress.tell("first step")
    assert progress.line() == "first step ... 10 s, about 50 s left"
    now[0] = 30.0
    progress.tell("round 1")
    assert progress.line() == "round 1 ... 30 s, about 30 s left"
    now[0] = 40.0
    assert progress.line() == "round 1 ... 40 s, about 20 s left"
    progress.tell("round 3 of 5")  # no message of the table: the time of the last one counts on
    assert progress.line() == "round 3 of 5 ... 40 s, about 20 s left"
    now[0] = 70.0
    assert progress.line() == "round 3 of 5 ... 70 s, longer than usual"


def test_the_time_left_of_a_step_that_counts_is_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    now = [5.0]
    progress = progress_of(monkeypatch, "other work", now)
    progress.tell("made 1 of 5")
    now[0] = 15.0
    progress.take_line("  made 3 of 5")
    assert progress.line() == "made 3 of 5 ... 10 s, about 15 s left"
    progress.take_line("nothing is counted here")
    progress.tell("judged 1 of 2: a case")
    now[0] = 19.0
    progress.tell("judged 2 of 2: another")
    assert progress.line() == "judged 2 of 2: another ... 14 s, about 4 s left"


@pytest.mark.parametrize(("seconds", "words"), [(0.2, "1 s"), (99.0, "99 s"), (150.0, "2 min"), (9000.0, "2.5 h")])
def test_times_are_said_in_the_unit_that_fits(seconds: float, words: str) -> None:
    assert in_time_words(seconds) == words


def watch(monkeypatch: pytest.MonkeyPatch) -> None:
    """A terminal that shows a line from the start, and each hundredth of a second."""
    monkeypatch.setattr("click.testing._NamedTextIOWrapper.isatty", lambda self: True, raising=False)
    monkeypatch.setattr(shown, "SHOWN_AFTER_S", 0.0)
    monkeypatch.setattr(shown, "TICK_S", 0.01)


def test_a_line_comes_while_a_step_tells_nothing_and_goes_before_the_result(monkeypatch: pytest.MonkeyPatch) -> None:
    @click.command()
    @prints_lines
    def toy() -> Iterator[str]:
        tell_progress("working")
        time.sleep(0.1)
        yield "a result"

    watch(monkeypatch)
    done = CliRunner().invoke(toy)
    assert done.stdout == "a result\n"
    assert done.stderr.count("working ...") > 2
    assert done.stderr.endswith("\r")


@pytest.fixture(scope="module")
def torque(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return recording_in(tmp_path_factory.mktemp("progress") / "rec", frame(0, 4), frame(1, 4))


@pytest.fixture(scope="module")
def motion(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_recording(tmp_path_factory.mktemp("progress") / "servo", {"kp": 40.0}, seconds=4.0)


@pytest.mark.parametrize(
    ("words", "step"),
    [
        (["recording", "check", "{torque}", "--out", "{out}/check.html"], "asking how it is to be read"),
        (["identify", "{torque}", "--out", "{out}/model"], "fitting"),
        (["diagnose", "{torque}", "--out", "{out}/verdict"], "searching, round 1"),
        (["diagnose", "{motion}", "--out", "{out}/motion"], "fitting each joint alone"),
        (["model", "confusability", "irb120-arm", "{torque}"], "model confusability"),
    ],
)
def test_a_long_command_shows_its_steps_and_a_first_number_at_once(
    words: list[str], step: str, torque: Path, motion: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    watch(monkeypatch)
    done = CliRunner().invoke(main, [word.format(torque=torque, motion=motion, out=tmp_path) for word in words])
    assert done.exit_code == 0, done.output
    lines = done.stderr.split("\r")
    assert any(line.startswith(f"{step} ...") for line in lines)
    assert any(line.endswith(" left") for line in lines[: max(len(lines) // 5, 10)])


def test_a_report_counts_the_algorithms_that_it_measures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from bench.report import page

    told: list[str] = []
    monkeypatch.setattr(page, "measure_isolated", lambda name: None)
    results: Any = SimpleNamespace(settings="algorithms: {a: {name: de}, b: {name: spso}}")
    page._measure_participants(results, tmp_path / "none.sqlite", told.append)
    assert told == ["measuring algorithms, 1 of 2", "measuring algorithms, 2 of 2"]
