"""Results in parts: the halves of a sweep from two stores, or from two folders, are those of the whole."""

import json
import sqlite3
from pathlib import Path

import pandas as pd
import pytest
from refusals import refusal

from bench.result_sets.formats import read_results, share_results
from bench.result_sets.join import join_parts
from bench.run import load_experiment, run_missing
from bench.store import open_store


def drain(lines: object) -> list[str]:
    return list(lines)


@pytest.fixture
def halves(small: Path) -> tuple[Path, Path]:
    """Two stores, each with one of the two algorithms."""
    entries = load_experiment(small).entries
    paths = small.with_name("a.sqlite"), small.with_name("b.sqlite")
    for path, half in zip(paths, (entries[:3], entries[3:]), strict=True):
        with open_store(path) as store:
            run_missing(half, store, 1)
    return paths


def test_two_stores_become_one_with_every_trial(small: Path, halves: tuple[Path, Path]) -> None:
    whole = small.with_name("whole.sqlite")
    said = drain(join_parts([*halves, halves[0]], whole, any_versions=False))
    assert said[-1] == f"6 outcomes are in {whole}"
    assert said[2] == f"0 outcomes of {halves[0]} are new"
    assert len(read_results(small, whole).trials) == 6
    assert refusal(drain, join_parts(halves, whole, any_versions=False)).endswith("name a new one with --out")


def test_a_half_is_reported_with_what_is_missing(small: Path, halves: tuple[Path, Path]) -> None:
    found = read_results(small, halves[0])
    assert found.gaps == ("3 of 3 trials of de on sphere are missing",)
    assert set(found.trials["algorithm"]) == {"spso"}


def test_stores_of_other_versions_are_joined_only_where_that_is_wanted(small: Path, halves: tuple[Path, Path]) -> None:
    with sqlite3.connect(halves[1]) as connection:
        (facts,) = connection.execute("SELECT facts FROM provenance").fetchone()
        connection.execute("UPDATE provenance SET facts = ?", (json.dumps(json.loads(facts) | {"simd": "other"}),))
    out = small.with_name("whole.sqlite")
    message = refusal(drain, join_parts(halves, out, any_versions=False))
    assert message.startswith("simd is '")
    assert message.endswith("--any-versions")
    assert not out.exists()
    assert drain(join_parts(halves, out, any_versions=True))[-1] == f"6 outcomes are in {out}"


def test_two_folders_of_tables_become_one_and_other_seeds_are_refused(small: Path, halves: tuple[Path, Path]) -> None:
    folders = [small.with_name(name) for name in ("left", "right")]
    for path, folder in zip(halves, folders, strict=True):
        share_results(small, path, "csv", folder)
    whole = small.with_name("whole")
    drain(join_parts(folders, whole, any_versions=False))
    joined = read_results(whole, Path("none"))
    stored = small.with_name("whole.sqlite")
    drain(join_parts(halves, stored, any_versions=False))
    pd.testing.assert_frame_equal(joined.trials, read_results(small, stored).trials)
    settings = folders[1] / "settings.yaml"
    settings.write_text(settings.read_text().replace("seed: 1", "seed: 2"))
    assert "only runs of one seed are paired" in refusal(drain, join_parts(folders, small.with_name("n"), False))


def test_two_ends_of_one_trial_are_refused(small: Path, halves: tuple[Path, Path]) -> None:
    folders = [small.with_name(name) for name in ("left", "right")]
    for folder in folders:
        share_results(small, halves[0], "csv", folder)
    table = pd.read_csv(folders[1] / "trials.csv")
    table.loc[1, "value"] *= 2
    table.to_csv(folders[1] / "trials.csv", index=False)
    message = refusal(drain, join_parts(folders, small.with_name("whole"), any_versions=False))
    assert message == "sphere, 5, 25, spso, 1 has another end in each part"


def test_two_ends_of_one_trial_in_stores_are_refused_and_nothing_is_written(
    small: Path, halves: tuple[Path, Path]
) -> None:
    other = small.with_name("other.sqlite")
    with sqlite3.connect(halves[0]) as source, sqlite3.connect(other) as copy:
        source.backup(copy)
        copy.execute("UPDATE trials SET value = value * 2")
    out = small.with_name("whole.sqlite")
    assert refusal(drain, join_parts([halves[0], other], out, any_versions=True)).endswith(
        "another end in an earlier part"
    )
    assert not out.exists()


def test_a_trial_that_failed_in_one_folder_and_was_finished_in_the_other_is_finished(
    small: Path, halves: tuple[Path, Path]
) -> None:
    folders = [small.with_name(name) for name in ("left", "right")]
    for folder in folders:
        share_results(small, halves[0], "csv", folder)
    finished = read_results(folders[1], Path("none"))
    trials, curves = (pd.read_csv(folders[0] / f"{table}.csv") for table in ("trials", "curves"))
    trials["failure"] = trials["failure"].astype("str").where(trials["repetition"] != 1, "it took too long")
    trials["failure"] = trials["failure"].replace("nan", "")
    trials.loc[trials["repetition"] == 1, ["value", "violation"]] = [float("nan"), float("inf")]
    trials.to_csv(folders[0] / "trials.csv", index=False)
    curves[curves["repetition"] != 1].to_csv(folders[0] / "curves.csv", index=False)
    whole = small.with_name("whole")
    drain(join_parts(folders, whole, any_versions=False))
    joined = read_results(whole, Path("none"))
    assert joined.gaps == ()
    assert sorted(joined.trials["value"]) == sorted(finished.trials["value"])
