"""Ctrl-C loses nothing that is finished, and the same command goes on from there."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from stored_trials import kept as stored


@pytest.fixture
def slow(small: Path, plug_in: Callable[[str], Path]) -> Path:
    """A configuration of twelve trials, 0.1 s and a batch each."""
    plug_in("time.sleep(0.1)")
    text = small.read_text().replace("[spso, de]", "[plug-in]").replace("repetitions: 3", "repetitions: 12")
    small.write_text(text.replace("iterations: 4", "iterations: 3999"))
    return small


@pytest.mark.parametrize("workers", ["1", "2"])
def test_ctrl_c_keeps_what_is_finished_and_a_second_start_does_the_rest(
    tmp_path: Path, slow: Path, armlab: Callable[..., object], workers: str
) -> None:
    said, code = _stopped_after_three(tmp_path, slow, "--workers", workers)
    kept = stored(tmp_path)
    assert 3 <= len(kept) < 12
    assert code == 130
    assert said.splitlines() == [
        f"armlab: stopped: {len(kept)} trials are finished and kept, {12 - len(kept)} are left; "
        "the same command goes on from here"
    ]
    assert not (tmp_path / "results" / "small.csv").exists()
    armlab("run", slow, "--workers", workers)
    assert len(stored(tmp_path)) == 12
    assert kept.items() <= stored(tmp_path).items()  # the same seconds: not run again
    assert (tmp_path / "results" / "small.csv").exists()


def test_a_stopped_fresh_start_goes_on_without_being_fresh_again(tmp_path: Path, slow: Path) -> None:
    said, code = _stopped_after_three(tmp_path, slow, "--workers", "1", "--fresh")
    assert code == 130
    assert said.endswith("are left; the same command without --fresh goes on from here\n")


def test_a_killed_run_leaves_a_sound_store_and_a_second_start_does_the_rest(
    tmp_path: Path, slow: Path, armlab: Callable[..., object]
) -> None:
    _stopped_after_three(tmp_path, slow, "--workers", "1", how=signal.SIGKILL)
    kept = stored(tmp_path)
    assert 3 <= len(kept) < 12
    armlab("run", slow, "--workers", "1")
    assert len(stored(tmp_path)) == 12
    assert kept.items() <= stored(tmp_path).items()


def _stopped_after_three(
    folder: Path, config: Path, *options: str, how: signal.Signals = signal.SIGINT
) -> tuple[str, int]:
    """What the command says, and its exit code, after a signal when three trials are in the store."""
    command = [sys.executable, "-m", "armlab.cli.main", "run", str(config), *options]
    running = subprocess.Popen(
        command, cwd=folder, stderr=subprocess.PIPE, text=True, start_new_session=True, preexec_fn=_hear_ctrl_c
    )
    while len(stored(folder)) < 3 and running.poll() is None:
        time.sleep(0.02)
    os.killpg(running.pid, how)  # a terminal, too, sends it to the workers as well
    said = running.communicate(timeout=120)[1]
    return said, running.returncode


def _hear_ctrl_c() -> None:
    """In the child: a test run in the background passes on that Ctrl-C is ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
