"""What can go wrong in a run, really brought about: each is told in a sentence, and none loses a finished trial."""

import resource
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from refusals import refusal

from armlab.common.errors import InputError
from bench.execute import run_trial
from bench.run import load_experiment, run_missing
from bench.statistics import summarise
from bench.store import open_store, salvage
from problem.contract import Evaluation

Armlab = Callable[..., "subprocess.CompletedProcess[str]"]
PlugIn = Callable[[str], Path]
MANY = 400


@pytest.fixture
def many(small: Path) -> Path:
    """The small experiment with 400 trials, which fill some hundred kilobytes."""
    small.write_text(small.read_text().replace("repetitions: 3", f"repetitions: {MANY // 2}"))
    return small


def _count(store: Path) -> int:
    with closing(sqlite3.connect(store)) as connection:
        return int(connection.execute("SELECT count(*) FROM trials").fetchone()[0])


def test_a_full_disk_is_told_keeps_what_was_kept_and_the_run_goes_on_when_there_is_room(many: Path) -> None:
    entries = load_experiment(many).entries
    path = many.with_name("runs.sqlite")
    with open_store(path) as store:
        run_missing(entries[:50], store, 1)
        store._connection.execute("PRAGMA max_page_count = 60")  # SQLite itself then says that the disk is full
        said = refusal(run_missing, entries, store, 1)
    assert said == (
        f"cannot use the run store {path}: database or disk is full; all outcomes stored before are safe: "
        "free some space, and the same command continues"
    )
    assert 50 <= _count(path) < MANY
    with open_store(path) as store:
        run_missing(entries, store, 1)
    assert _count(path) == MANY


def test_a_file_that_may_not_grow_is_a_line_and_exit_code_2(many: Path) -> None:
    def no_large_files() -> None:
        resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, 100_000))

    command = [sys.executable, "-m", "armlab.cli.main", "run", many.name]
    done = subprocess.run(
        command, cwd=many.parent, capture_output=True, text=True, preexec_fn=no_large_files, check=False
    )
    assert done.returncode == 2
    assert done.stderr.count("\n") == 1
    assert "free some space, and the same command continues" in done.stderr


def _damaged(many: Path, where: float, what: bytes) -> tuple[Path, int]:
    """A store of which a stretch from that share of the file on has other bytes; and its outcomes before."""
    path = many.with_name("runs.sqlite")
    with open_store(path) as store:
        run_missing(load_experiment(many).entries, store, 1)
    content = bytearray(path.read_bytes())
    first = int(where * len(content)) // 4096 * 4096
    content[first : first + len(what)] = what
    path.write_bytes(content)
    return path, MANY


@pytest.mark.parametrize("where", [0.1, 0.5, 0.9])
def test_what_is_readable_of_a_damaged_store_is_saved_and_the_rest_computed_again(
    many: Path, armlab: Armlab, where: float
) -> None:
    path, before = _damaged(many, where, b"\xff" * 8192)
    damaged = path.read_bytes()
    refused = armlab("run", many.name, "--store", path)
    assert refused.returncode == 2
    assert "malformed; `armlab bench salvage" in refused.stderr
    assert refused.stderr.count("\n") == 1
    saved = armlab("bench", "salvage", path, "--out", "new.sqlite")
    assert saved.returncode == 0, saved.stderr
    assert path.read_bytes() == damaged
    kept = _count(many.with_name("new.sqlite"))
    assert 0.5 * before < kept < before
    assert saved.stdout == f"{kept} outcomes of {path} are in new.sqlite\n"
    with open_store(many.with_name("new.sqlite")) as store:
        entries = load_experiment(many).entries
        for entry in [entry for entry in entries if store.has(entry.key)][::20]:
            assert store.get(entry.key).value == run_trial(entry.trial).value
        run_missing(entries, store, 1)
    assert _count(many.with_name("new.sqlite")) == before


def test_a_truncated_store_is_told_and_saved_as_far_as_it_goes(many: Path) -> None:
    path, before = _damaged(many, 0.0, b"")
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 4 // 4096 * 4096])
    with pytest.raises(InputError, match="malformed"), open_store(path) as store:
        run_missing(load_experiment(many).entries, store, 1)
    assert 0 < salvage(path, many.with_name("new.sqlite")) < before


def test_what_cannot_be_saved_is_told(many: Path, tmp_path: Path) -> None:
    path, _ = _damaged(many, 0.0, b"\xff" * 4096)
    assert "nothing of " in refusal(salvage, path, tmp_path / "new.sqlite")
    assert "exists already" in refusal(salvage, path, many)
    assert "there is no run store" in refusal(salvage, tmp_path / "none", tmp_path / "new.sqlite")
    assert not (tmp_path / "new.sqlite").exists()


def test_two_runners_on_one_store_share_the_work(small: Path, plug_in: PlugIn) -> None:
    notes = plug_in("time.sleep(0.05)")
    text = small.read_text().replace("[spso, de]", "[plug-in]").replace("repetitions: 3", "repetitions: 200")
    text = text.replace("swarm_size: 5", "swarm_size: 500")
    small.write_text(text.replace("iterations: 4", "iterations: 9"))  # 5,000 evaluations: four trials a batch
    commands = [
        [sys.executable, "-m", "armlab.cli.main", "run", small.name, "--workers", "1", "--results", f"r{k}"]
        for k in range(2)
    ]
    running = [subprocess.Popen(command, cwd=small.parent, stdout=subprocess.DEVNULL) for command in commands]
    assert [one.wait(300) for one in running] == [0, 0]
    assert _count(small.parent / ".armlab" / "runs.sqlite") == 200
    tables = [(small.parent / f"r{k}" / "small.csv").read_bytes() for k in range(2)]
    assert tables[0] == tables[1]
    assert 200 <= len(notes.read_text()) < 260  # in one order for both nearly every trial would run twice


@pytest.mark.parametrize(
    "hang",
    [
        "any(iter(int, 1))",
        "__import__('re').match('(a+)+$', 'a' * 40 + 'b')",  # in C, and never lets go of the interpreter
    ],
)
def test_a_trial_that_hangs_is_ended_and_told_and_the_others_are_kept(
    small: Path, plug_in: PlugIn, armlab_process: Armlab, hang: str
) -> None:
    plug_in(f"if population[0, 0] > 0: {hang}")
    text = small.read_text().replace("[spso, de]", "[plug-in, de]").replace("repetitions: 3", "repetitions: 4")
    small.write_text(text + "trial_timeout_s: 0.5\n")
    entries = load_experiment(small).entries
    stuck = [entry for entry in entries if entry.algorithm == "plug-in" and _first_coordinate(entry.trial) > 0]
    assert 0 < len(stuck) < 4
    done = armlab_process("run", small.name)
    assert done.returncode == 1
    which = ", ".join(str(entry.trial.repetition) for entry in stuck)
    assert f"{stuck[0].trial.series_text}, repetition {which}: WorkerLostError: the worker process died twice" in (
        done.stderr
    )
    assert "trial_timeout_s = 0.5" in done.stderr
    assert _count(small.parent / ".armlab" / "runs.sqlite") == len(entries) - len(stuck)


def _first_coordinate(trial: object) -> float:
    from algorithms.contract import Box
    from bench.execute import build_problem
    from bench.seeds import first_population

    problem = build_problem(trial.problem)
    box = Box(problem.lower, problem.upper)
    return float(first_population(trial.seed, problem.name, trial.repetition, trial.swarm_size, box)[0, 0])


def test_a_worker_that_is_killed_by_its_trial_is_replaced_and_the_trial_named(
    small: Path, plug_in: PlugIn, armlab_process: Armlab
) -> None:
    plug_in("if population[0, 0] > 0: __import__('os').kill(__import__('os').getpid(), 9)")
    text = small.read_text().replace("[spso, de]", "[plug-in, de]").replace("iterations: 4", "iterations: 3999")
    small.write_text(text)
    entries = load_experiment(small).entries
    fatal = [entry for entry in entries if entry.algorithm == "plug-in" and _first_coordinate(entry.trial) > 0]
    assert fatal
    done = armlab_process("run", small.name, "--workers", "2")
    assert done.returncode == 1
    assert f"{len(fatal)} trials failed" in done.stderr
    assert _count(small.parent / ".armlab" / "runs.sqlite") == len(entries) - len(fatal)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("RandomSearch.ask = staticmethod(lambda state: (state.population[:, :2], state))", "shape"),
        ("RandomSearch.ask = staticmethod(lambda state: (None, state))", "asks for NoneType"),
        ("RandomSearch.incumbent = staticmethod(lambda state: 1 / 0)", "ZeroDivisionError"),
    ],
)
def test_a_plug_in_that_breaks_a_promise_is_named_and_its_neighbours_are_kept(
    small: Path, plug_in: PlugIn, armlab: Armlab, fault: str, said: str
) -> None:
    plug_in(fault.replace("RandomSearch.", "PlugIn."))
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in, de]"))
    done = armlab("run", small.name)
    assert done.returncode == 1
    assert "3 trials failed" in done.stderr
    assert said in done.stderr
    assert _count(small.parent / ".armlab" / "runs.sqlite") == 3


@pytest.mark.parametrize(
    "statement",
    [
        "population[:] = 7.0; __import__('numpy').random.seed(1)",
        "box.lower[:] = 0.9 * box.upper",
        "__import__('numpy').seterr(all='raise')",
    ],
)
def test_what_an_algorithm_writes_into_harms_no_neighbour(small: Path, plug_in: PlugIn, statement: str) -> None:
    plug_in(statement)
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in, de]"))
    entries = load_experiment(small).entries
    with open_store(small.with_name("runs.sqlite")) as store:
        run_missing(entries, store, 1)
        for entry in entries[3:]:
            assert store.get(entry.key).value == run_trial(entry.trial).value


def test_an_objective_that_is_not_a_number_is_a_loss_and_no_end_is_feasible(small: Path) -> None:
    small.write_text(small.read_text().replace("seed: 1", "seed: 1\ntrial_timeout_s: 5"))
    trial = load_experiment(small).entries[0].trial

    class Nowhere:
        name, lower, upper = "nowhere", np.zeros(3), np.ones(3)

        def evaluate(self, points: np.ndarray) -> Evaluation:
            return Evaluation(*(np.full(len(points), number) for number in (np.nan, np.nan, 0.0)))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("bench.execute.build_problem", lambda settings: Nowhere())
        outcome = run_trial(trial)
    assert outcome.fitness == np.inf
    assert np.isnan(outcome.value)
    assert summarise(np.array([outcome.value]), np.array([outcome.violation])).feasible_share == 0.0


def test_a_problem_whose_value_is_negative_is_told_what_to_do(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Statistics take the logarithm of the ends."""
    trial = load_experiment(small).entries[0].trial

    class Below:
        name, lower, upper = "below", np.zeros(3), np.ones(3)

        def evaluate(self, points: np.ndarray) -> Evaluation:
            return Evaluation(*(np.full(len(points), number) for number in (-1.0, -1.0, 0.0)))

    monkeypatch.setattr("bench.execute.build_problem", lambda settings: Below())
    with pytest.raises(ValueError, match="'below' gave the value -1: add a constant"):
        run_trial(trial)


def test_a_clock_that_is_set_back_changes_no_duration(small: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    trial = load_experiment(small).entries[0].trial
    times = iter(range(10**9, 0, -3600))
    monkeypatch.setattr("time.time", lambda: next(times))
    before = time.process_time()
    outcome = run_trial(trial)
    assert 0 <= outcome.seconds <= time.process_time() - before
    assert next(times) == 10**9  # nobody asked
