"""What goes to other packages and comes back, without those packages."""

from dataclasses import replace
from pathlib import Path

import pytest
from numpy.testing import assert_allclose, assert_array_equal
from public_copies import needs_copies
from simulated_arm import run, structure, truth

from armlab.identification.regression import signals_of
from armlab.proof.open.peers.exchange import PeerRun, read_runs, write_runs
from armlab.proof.open.peers.side_by_side import PeerResult, compare_peers, write_peers
from armlab.proof.open.real_identification.identify_recording import recipe_named, study_recording
from armlab.proof.open.real_identification.looks import Looks
from armlab.recordings.public import open_public_recording


@pytest.fixture
def peer_run() -> PeerRun:
    model = structure()
    signals = signals_of(run(model, truth(model), noise=0.05), 5.0)
    motion = signals.motion
    return PeerRun(
        "run.csv", "identify", motion.position, motion.velocity, motion.acceleration, signals.run.torque, 250.0, 5.0, 12
    )


def test_runs_arrive_as_they_were_sent(tmp_path: Path, peer_run: PeerRun) -> None:
    other = replace(peer_run, name="b.csv", role="validate", position=peer_run.position[:100])
    write_runs((peer_run, other), tmp_path / "runs.npz")
    for sent, read in zip((peer_run, other), read_runs(tmp_path / "runs.npz"), strict=True):
        assert (read.name, read.role, read.rate_hz, read.step) == (sent.name, sent.role, 250.0, 12)
        assert_array_equal(read.position, sent.position)


def test_a_thinned_run_shows_the_same_filtered_torque(peer_run: PeerRun) -> None:
    whole = peer_run.low_pass.smooth(peer_run.torque)[::5]
    thinned = peer_run.thinned(5)
    assert thinned.rate_hz == 50.0
    assert_allclose(thinned.torque, whole)
    assert thinned.low_pass(thinned.torque).shape[1] == 3


def test_the_page_holds_a_row_for_each_package_and_why_one_has_no_figure(tmp_path: Path) -> None:
    rows = [
        PeerResult("emps", "armlab, chosen", "pulses.csv", 4.7, 0.1),
        PeerResult("emps", "other", "", None, None, "no module"),
    ]
    text = write_peers(rows, tmp_path).read_text()
    assert "| emps | pulses.csv | armlab, chosen | 4.70 | 0.1 |" in text
    assert "| emps |  | other | no module |  |" in text


@needs_copies("emps")
def test_an_interpreter_that_is_not_there_is_told_for_each_peer_and_ours_still_runs(tmp_path: Path) -> None:
    study = study_recording(recipe_named("emps"), open_public_recording("emps", tmp_path / "recordings"))
    looks = Looks(tmp_path / "looks.jsonl")
    rows = list(compare_peers(study, Path("/no/python"), tmp_path / "peers", looks))
    text = write_peers(rows, tmp_path).read_text()
    assert text.count("no interpreter /no/python") == 2
    assert "| emps | pulses.csv | armlab, chosen | " in text
    assert looks.count("emps", "pulses.csv") == 4
