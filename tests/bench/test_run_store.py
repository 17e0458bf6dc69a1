"""The run store keeps outcomes through crashes and rivals, and refuses what is not its own."""

import math
import sqlite3
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import pytest

from armlab.common.errors import InputError
from bench.execute import Curves, Outcome
from bench.store import SCHEMA_VERSION, open_store

CURVES = Curves(*(np.arange(5.0) + k for k in range(5)))
OUTCOME = Outcome(4.5, 0.0, 4.75, 25, 0.125, np.array([1.0, -2.0]), CURVES)


def test_an_outcome_comes_back_to_the_bit(tmp_path: Path) -> None:
    with open_store(tmp_path / "runs.sqlite") as store:
        store.add([("key", OUTCOME)], "{}")
    with open_store(tmp_path / "runs.sqlite") as store:
        _assert_same(store.get("key"), OUTCOME)
        assert store.figures("key") == (4.5, 0.0, 4.75, 25, 0.125, 2)


def test_values_that_are_not_finite_come_back(tmp_path: Path) -> None:
    odd = replace(OUTCOME, value=math.nan, violation=math.inf, fitness=math.inf)
    with open_store(tmp_path / "runs.sqlite") as store:
        store.add([("key", odd)], "{}")
        found = store.get("key")
    assert math.isnan(found.value)
    assert (found.violation, found.fitness) == (math.inf, math.inf)


def test_an_outcome_that_is_there_is_never_written_again(tmp_path: Path) -> None:
    with open_store(tmp_path / "runs.sqlite") as store:
        store.add([("key", OUTCOME)], "{}")
        store.add([("key", replace(OUTCOME, value=9.0, best_x=np.zeros(2)))], "{}")
        _assert_same(store.get("key"), OUTCOME)


def test_only_outcomes_that_are_there_are_done(tmp_path: Path) -> None:
    with open_store(tmp_path / "runs.sqlite") as store:
        store.add([("a", OUTCOME), ("b", OUTCOME)], "{}")
        assert [store.has(key) for key in "abc"] == [True, True, False]
        store.forget(["a"])
        assert [store.has(key) for key in "abc"] == [False, True, False]
        with pytest.raises(KeyError):
            store.get("a")


def test_provenance_stands_beside_each_outcome(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite"
    with open_store(path) as store:
        store.add([("a", OUTCOME)], '{"numpy": "1"}')
        store.add([("b", OUTCOME)], '{"numpy": "2"}')
    joined = "SELECT key, facts FROM trials JOIN provenance ON provenance.id = trials.provenance ORDER BY key"
    with sqlite3.connect(path) as connection:
        assert connection.execute(joined).fetchall() == [("a", '{"numpy": "1"}'), ("b", '{"numpy": "2"}')]
    connection.close()


def test_a_batch_that_fails_half_way_leaves_nothing(tmp_path: Path) -> None:
    with open_store(tmp_path / "runs.sqlite") as store:
        with pytest.raises(sqlite3.IntegrityError):
            store.add([("a", OUTCOME), ("b", replace(OUTCOME, evaluations=None))], "{}")
        assert not store.has("a")
        assert not store.has("b")


def _add_fifty(path: Path, own: float) -> None:
    for k in range(50):
        with open_store(path) as store:
            store.add([(f"key {k}", replace(OUTCOME, value=own))], "{}")


def test_rival_runners_write_every_outcome_once(tmp_path: Path) -> None:
    path = tmp_path / "folder" / "runs.sqlite"
    with ProcessPoolExecutor(4, mp_context=get_context("spawn")) as pool:
        for done in [pool.submit(_add_fifty, path, own) for own in (1.0, 2.0, 3.0, 4.0)]:
            done.result()
    with sqlite3.connect(path) as connection:
        assert connection.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert connection.execute("SELECT count(*) FROM trials").fetchone() == (50,)
        assert connection.execute("SELECT count(*) FROM arrays").fetchone() == (50 * 6,)
    connection.close()


def test_a_file_that_is_no_store_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite"
    path.write_text("not a database at all, but long enough to be looked at" * 100)
    assert _refusal(path) == f"cannot use the run store {path}: file is not a database"


def test_a_damaged_store_is_refused_in_one_line(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite"
    with open_store(path) as store:
        store.add([(f"key {k}", OUTCOME) for k in range(200)], "{}")
    content = bytearray(path.read_bytes())
    content[4096:] = b"\xff" * (len(content) - 4096)
    path.write_bytes(content)
    with pytest.raises(InputError, match="malformed"), open_store(path) as store:
        store.get("key 7")


def test_a_database_of_another_program_is_refused_and_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite"
    with sqlite3.connect(path) as connection:
        connection.execute("CREATE TABLE theirs (x)")
    connection.close()
    before = path.read_bytes()
    assert "database of another program" in _refusal(path)
    assert path.read_bytes() == before


def test_a_store_of_another_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "runs.sqlite"
    with open_store(path):
        pass
    with sqlite3.connect(path) as connection:
        connection.execute(f"PRAGMA user_version = {SCHEMA_VERSION + 1}")
    connection.close()
    assert f"run store of version {SCHEMA_VERSION + 1}" in _refusal(path)


def test_a_place_that_cannot_hold_a_store_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "cannot write the run store" in _refusal(tmp_path / "file" / "runs.sqlite")
    assert "unable to open database file" in _refusal(tmp_path)


def _refusal(path: Path) -> str:
    with pytest.raises(InputError) as caught, open_store(path):
        pass
    assert "\n" not in str(caught.value)
    return str(caught.value)


def _assert_same(found: Outcome, expected: Outcome) -> None:
    for name in ("value", "violation", "fitness", "evaluations", "seconds"):
        assert getattr(found, name) == getattr(expected, name)
    np.testing.assert_array_equal(found.best_x, expected.best_x)
    for name in Curves.__dataclass_fields__:
        np.testing.assert_array_equal(getattr(found.curves, name), getattr(expected.curves, name))
