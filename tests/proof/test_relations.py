"""Relations that need no truth: the short ones hold on a small recording, and a broken one is said."""

from pathlib import Path

import numpy as np
import pytest
from small_recordings import frame, recording_in

from armlab.proof.open.relations.all_relations import check_relations, relations_page
from armlab.proof.open.relations.relations import (
    NULL_PAIRS,
    PARTS,
    QUICK,
    RELATIONS,
    Desk,
    RelationOutcome,
    check_relation,
)
from armlab.proof.open.relations.variants import (
    every_other_second,
    half,
    one_run,
    parts_of,
    resampled,
    rewritten,
    thinned,
)
from armlab.recordings.load import load_recording
from armlab.recordings.recording import Recording

MORE = (
    "X against X, rows thinned",
    "run against run",
    "what is seen plainly is named",
    "units, order, names, clock",
)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    return load_recording(recording_in(tmp_path_factory.mktemp("own") / "arm", frame(0, 6), frame(1, 6)))


@pytest.fixture(scope="module")
def desk() -> Desk:
    return Desk()


@pytest.mark.parametrize("name", [*QUICK, *MORE])
def test_relation_holds_on_a_small_recording(name: str, recording: Recording, desk: Desk) -> None:
    outcome = check_relation(name, recording, desk)
    assert outcome.holds, outcome.detail


def test_verdicts_on_spoilt_copies_and_on_a_part_contradict_nothing(
    recording: Recording, desk: Desk, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("armlab.proof.open.relations.relations.parts_of", lambda each: [("half", half(each, 0))])
    outcome = check_relation(PARTS, recording, desk)
    assert outcome.holds, outcome.detail
    assert outcome.detail == "4 verdicts"
    monkeypatch.setattr("armlab.proof.open.relations.relations.contradictions", lambda verdict: ("a sentence twice",))
    monkeypatch.setattr("armlab.proof.open.relations.relations.spoilt", lambda each: [])
    assert check_relation(PARTS, recording, desk).detail == "half: a sentence twice"


def test_variants_hold_the_same_motion(recording: Recording) -> None:
    first = recording.runs[0]
    assert thinned(recording).runs[0].samples == 4 * first.samples // 5
    other = resampled(recording).runs[0]
    assert other.rate_hz == pytest.approx(0.9 * first.rate_hz)
    there = np.interp(other.time, first.time, first.position[:, 1])
    assert np.abs(other.position[:, 1] - there).max() < 1e-3
    assert [run.name for run in rewritten(recording).runs] == [run.name for run in reversed(recording.runs)]


def test_odd_and_even_seconds_share_no_row(recording: Recording) -> None:
    even, odd = (every_other_second(recording, first, 1.0) for first in (0, 1))
    stamps = [{(run.file, float(time)) for run in each.runs for time in run.time} for each in (even, odd)]
    assert not stamps[0] & stamps[1]
    assert len(even.runs) == len(odd.runs) == 6


def test_halves_and_single_runs_share_no_row(recording: Recording) -> None:
    first, second = half(recording, 0).runs[0], half(recording, 1).runs[0]
    assert first.time[-1] < second.time[0]
    assert first.samples == second.samples == recording.runs[0].samples // 2
    alone = [one_run(recording, run) for run in recording.runs]
    assert [[run.name for run in each.runs] for each in alone] == [[run.name] for run in recording.runs]
    assert all(run.role == "identify" for each in alone for run in each.runs)


def test_a_broken_relation_stands_in_the_table() -> None:
    page = relations_page(
        [RelationOutcome("arm", "X against X", False, "payload@3"), RelationOutcome("leg", "X against X", None, "-")]
    )
    assert "| X against X | **broken** | no answer |" in page
    assert "payload@3" in page


def test_outcomes_are_kept_for_the_next_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = recording_in(tmp_path / "arm", frame(0, 6), frame(1, 6))
    asked: list[str] = []

    def answer(name: str, recording: Recording, desk: Desk) -> RelationOutcome:
        asked.append(name)
        return RelationOutcome(recording.name, name, True, "")

    monkeypatch.setattr("armlab.proof.open.relations.all_relations.check_relation", answer)
    for _ in range(2):
        lines = list(check_relations(tmp_path / "results", tmp_path / "none", [folder], ["arm"]))
    assert asked == list(RELATIONS)
    assert len(lines) == len(RELATIONS) + 2


def test_null_pairs_are_counted_on_a_page_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = recording_in(tmp_path / "arm", frame(0, 6), frame(1, 6))
    answers = dict(zip(NULL_PAIRS, (True, False, None), strict=True))

    def answer(name: str, recording: Recording, desk: Desk) -> RelationOutcome:
        return RelationOutcome(recording.name, name, answers[name], "")

    monkeypatch.setattr("armlab.proof.open.relations.all_relations.check_relation", answer)
    lines = list(check_relations(tmp_path / "results", tmp_path / "none", [folder], ["arm"], NULL_PAIRS))
    assert "2 answers, a change is named in 1 (95 % interval 9.45 to 90.5 %)" in lines[-2]
    assert [path.name for path in (tmp_path / "results").glob("*.md")] == ["null-pairs.md"]


def test_parts_are_cut_from_the_whole(recording: Recording) -> None:
    parts = dict(parts_of(recording))
    rows = {name: sum(run.samples for run in each.runs) for name, each in parts.items()}
    assert rows["half 1"] == rows["half 2"] == rows["whole"] // 2
    assert rows["every row in 3"] == pytest.approx(rows["whole"] / 3, abs=len(recording.runs))
    assert "first 12 s" not in parts
    assert all(run.time[-1] - run.time[0] <= 4.0 for run in parts["first 4 s"].runs)
