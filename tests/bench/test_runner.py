"""The runner does what is missing, in any order and on any number of workers, and keeps all that finishes."""

import random
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest

from bench.dispatch import missing_entries
from bench.errors import StoppedError, TrialsFailedError
from bench.execute import run_trial
from bench.plan import Entry
from bench.run import load_experiment, run_missing
from bench.store import open_store
from bench.tables import as_csv, summary_table, tidy_frame

PlugIn = Callable[[str], Path]


def _table(entries: Sequence[Entry], order: Sequence[Entry], store_path: Path, workers: int) -> str:
    with open_store(store_path) as store:
        run_missing(order, store, workers)
        return as_csv(summary_table(tidy_frame(entries, store)))


def test_the_table_is_the_same_to_the_byte_for_one_two_and_four_workers_in_any_order(small: Path) -> None:
    small.write_text(
        small.read_text()
        .replace("[spso, de]", "[mupso, spso, woa, gwo, goa, de, random-search, cma-es]")
        .replace("swarm_size: 5", "swarm_size: [20, 50]")
        .replace("iterations: 4", "iterations: 30")
    )
    entries = load_experiment(small).entries
    shuffled = random.Random(1).sample(entries, len(entries))
    tables = [
        _table(entries, order, small.with_name(f"{k}.sqlite"), workers)
        for k, (order, workers) in enumerate([(entries, 1), (shuffled, 1), (entries, 2), (shuffled, 4)])
    ]
    assert len(tables[0].splitlines()) == 1 + 8 * 2
    assert len(set(tables)) == 1


def test_algorithms_begin_with_the_same_population(small: Path) -> None:
    entries = load_experiment(small).entries
    first = {(entry.trial.repetition, run_trial(entry.trial).curves.best_value[0]) for entry in entries}
    assert len(entries) == 6
    assert len(first) == 3  # one a repetition, whatever the algorithm


def test_curves_end_at_the_best_point_and_count_every_evaluation(small: Path) -> None:
    for entry in load_experiment(small).entries:
        outcome = run_trial(entry.trial)
        assert outcome.curves.best_value[-1] == outcome.value
        np.testing.assert_array_equal(outcome.curves.evaluations, [5, 10, 15, 20, 25])
        assert np.all(outcome.curves.present_value >= outcome.curves.best_value)


def test_a_second_run_does_only_what_is_missing(small: Path, plug_in: PlugIn) -> None:
    notes = plug_in("pass")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in]"))
    entries = load_experiment(small).entries
    with open_store(small.with_name("runs.sqlite")) as store:
        run_missing(entries[:1], store, 1)
        assert len(notes.read_text()) == 1
        assert list(missing_entries(entries, store)) == entries[1:]
        run_missing(entries, store, 1)
        run_missing(entries, store, 1)
    assert len(notes.read_text()) == 3


def test_a_trial_that_raises_is_named_and_not_kept_and_the_others_are(small: Path, plug_in: PlugIn) -> None:
    plug_in("if rng.random() > 0.5: raise ZeroDivisionError('of a third party')")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in]").replace("repetitions: 3", "repetitions: 8"))
    entries = load_experiment(small).entries
    with open_store(small.with_name("runs.sqlite")) as store:
        with pytest.raises(TrialsFailedError) as caught:
            run_missing(entries, store, 1)
        failed = list(missing_entries(entries, store))
        reasons = [store.failure(entry.key) for entry in entries]
    assert 0 < len(failed) < len(entries)
    assert reasons == ["ZeroDivisionError: of a third party" if entry in failed else None for entry in entries]
    which = ", ".join(str(entry.trial.repetition) for entry in failed)
    assert f"{failed[0].trial.series_text}, repetition {which}: {reasons[failed[0].trial.repetition]}" in str(
        caught.value
    )


def test_ctrl_c_is_told_with_what_is_kept_and_how_to_go_on(small: Path, plug_in: PlugIn) -> None:
    plug_in("raise KeyboardInterrupt")
    small.write_text(small.read_text().replace("[spso, de]", "[plug-in]"))
    entries = load_experiment(small).entries
    with (
        open_store(small.with_name("runs.sqlite")) as store,
        pytest.raises(StoppedError, match="0 trials are finished and kept, 3 are left; the same command goes on"),
    ):
        run_missing(entries, store, 1)


def test_the_present_best_shows_what_a_mutation_forgets(small: Path) -> None:
    mutating = "[{name: mupso, params: {abandonment_limit: 2, stagnation: no_improvement}}]"
    small.write_text(small.read_text().replace("[spso, de]", mutating).replace("iterations: 4", "iterations: 30"))
    curves = [run_trial(entry.trial).curves for entry in load_experiment(small).entries]
    assert any(np.any(curve.present_value > curve.best_value) for curve in curves)
    assert all(np.all(np.diff(curve.best_value) <= 0) for curve in curves)
