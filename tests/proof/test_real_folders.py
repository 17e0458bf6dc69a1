"""`armlab proof real` over folders, with a stand-in for the command that diagnoses."""

import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from numpy.testing import assert_allclose
from small_recordings import frame, recording_in

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.proof.open.real_folders import runs
from armlab.proof.open.real_folders.all_folders import FolderProof, prove_folders, prove_pieces
from armlab.proof.open.real_folders.errors import error_ratio, measure_errors
from armlab.proof.open.real_folders.recording_folders import find_folders
from armlab.recordings.public import LOCAL_COPIES_VARIABLE

STAND_IN = """
import json, pathlib, sys
folder, out = pathlib.Path(sys.argv[-3]), pathlib.Path(sys.argv[-1])
with (folder.parent / "asked.txt").open("a") as asked:
    asked.write(folder.name + "\\n")
if folder.name == "broken":
    sys.exit("armlab: link 1 is no body")
out.mkdir(parents=True)
finding = {"effect": "payload", "joint": 3, "parameters": {}, "probability": 0.95, "equation": "m_3 += 1 kg"}
finding |= {"heldout_rms_before": 1.0, "heldout_rms_after": 2.0, "rivals": []}
verdict = {"schema": "verdict/1", "status": "mismatch", "summary": "A payload.", "findings": [finding]}
(out / "verdict.json").write_text(json.dumps(verdict | {"located": [], "unexplained": [], "fit": []}))
"""
FACTS = {
    "schema": "facts/1",
    "singles": {
        "open": {"known": [{"effect": ["payload"], "joint": 3, "strong": True}]},
        "secret": {"licence": "none", "never": ["payload"]},
        "broken": {"known": [{"effect": ["payload"], "joint": 1}]},
    },
}


@pytest.fixture
def proof(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> FolderProof:
    """Three folders, of which one is refused and none can be read, and facts about them."""
    script = tmp_path / "stand_in.py"
    script.write_text(STAND_IN)
    monkeypatch.setattr(runs, "COMMAND", (sys.executable, str(script)))
    for name in ("open", "secret", "broken"):
        folder = tmp_path / "recordings" / name
        folder.mkdir(parents=True)
        (folder / "recording.yaml").write_text("schema: recording/1\n")
    facts = tmp_path / "facts.yaml"
    facts.write_text(yaml.safe_dump(FACTS))
    return FolderProof(tmp_path / "recordings", facts, tmp_path / "results", tmp_path / "work", jobs=1)


def asked(proof: FolderProof) -> list[str]:
    """The folders that were diagnosed, one entry a time."""
    assert proof.root is not None
    return sorted((proof.root / "asked.txt").read_text().split())


def test_single_recordings_and_pairs_are_found_at_any_depth(tmp_path: Path) -> None:
    for place in ("a", "b/deep", "pair/old", "pair/new", "half/old"):
        (tmp_path / place).mkdir(parents=True)
        (tmp_path / place / "recording.yaml").touch()
    (tmp_path / "raw").mkdir()
    found = {each.name: each.pair for each in find_folders(tmp_path)}
    assert found == {"a": False, "b/deep": False, "pair": True, "half/old": False}


def test_a_row_says_what_is_told_and_a_failing_folder_why(proof: FolderProof) -> None:
    lines = list(prove_folders(proof))
    assert any(line.startswith("open: status mismatch, named 1") for line in lines)
    assert "  wrong: never payload@3" in lines
    assert "  no verdict: armlab: link 1 is no body" in lines
    assert "no verdict: broken" in lines
    singles = next(line for line in lines if line.startswith("singles:"))
    assert "facts 1 named, 0 class, 0 cause, 0 minor, 1 missed; strong 1 named" in singles
    assert "WRONG 2, extra 0" in singles


def test_rows_without_a_licence_stand_on_the_local_page_alone(proof: FolderProof) -> None:
    list(prove_folders(proof))
    public = "".join(path.read_text() for path in proof.results.iterdir())
    local = (proof.work / "folders.md").read_text()
    assert "| open |" in public
    assert "secret" not in public
    assert "2 folders that may be published, of 3" in public
    assert "| secret |" in local
    assert (proof.work / ".gitignore").read_text() == "*\n"


def test_folders_of_which_nothing_is_known_have_a_row_and_stay_local(proof: FolderProof) -> None:
    lines = list(prove_folders(FolderProof(proof.root, None, proof.results, proof.work, jobs=1), ["open"]))
    assert any(line.startswith("open: status mismatch, contradictions 1, words 2, findings 1") for line in lines)
    assert not proof.results.exists()


def test_a_run_goes_on_where_it_stopped_and_asks_again_for_another_recording(proof: FolderProof) -> None:
    list(prove_folders(proof, ["open"]))
    assert "1 of 3 folders are done already" in list(prove_folders(proof))
    assert asked(proof) == ["broken", "open", "secret"]
    assert proof.root is not None
    (proof.root / "open" / "run.csv").write_text("t,q1\n")
    list(prove_folders(proof))
    assert asked(proof) == ["broken", "open", "open", "secret"]


def test_pieces_are_judged_by_what_is_known_of_the_whole(proof: FolderProof) -> None:
    assert proof.root is not None
    assert proof.facts is not None
    recording_in(proof.root / "told", frame(7), frame(8), sample_rate_hz=100.0)
    singles = FACTS["singles"] | {"told": {"known": [{"effect": ["payload"], "joint": 3}]}}
    proof.facts.write_text(yaml.safe_dump(FACTS | {"singles": singles}))
    lines = list(prove_pieces(proof, ["told"]))
    pieces = ("first-half", "second-half", "every-second-row")
    assert all(any(line.startswith(f"told--{each}: status mismatch, named 1") for line in lines) for each in pieces)
    page = (proof.results / "pieces.md").read_text()
    assert "# Pieces of recording folders" in page
    assert "| told--second-half |" in page
    cut = [(proof.work / "cut" / f"told--{each}" / "run-1.csv").read_text().splitlines()[1:] for each in pieces]
    whole = (proof.root / "told" / "run-1.csv").read_text().splitlines()[1:]
    assert (cut[0] + cut[1], cut[2]) == (whole, whole[::2])
    assert "sample_rate_hz: 50.0" in (proof.work / "cut" / "told--every-second-row" / "recording.yaml").read_text()


def test_pieces_without_facts_are_refused(proof: FolderProof) -> None:
    with pytest.raises(InputError, match="--part pieces needs --facts FILE"):
        list(prove_pieces(FolderProof(proof.root, None, proof.results, proof.work, jobs=1)))


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"singles": {"opn": {}}}, "names a recording that is not there, 'opn': did you mean 'open'?"),
        ({"pairs": {"open": {}}}, "'open' stands under pairs in"),
    ],
)
def test_facts_about_other_folders_are_refused_before_any_diagnosis(
    proof: FolderProof, change: dict[str, Any], message: str
) -> None:
    assert proof.facts is not None
    proof.facts.write_text(yaml.safe_dump({"schema": "facts/1", **change}))
    with pytest.raises(InputError) as caught:
        list(prove_folders(proof))
    assert message in str(caught.value)
    assert proof.root is not None
    assert not (proof.root / "asked.txt").exists()


def test_twice_the_error_is_a_ratio_of_two_with_no_spread() -> None:
    plain = np.random.default_rng(0).normal(size=400)
    ratio = error_ratio(2 * plain, plain, np.arange(400) // 20)
    assert_allclose([ratio.value, *(ratio.interval or ())], 2.0)
    assert error_ratio(plain, plain, np.arange(400) // 200).interval is None  # two blocks say nothing


def test_the_interval_of_a_ratio_holds_one_as_often_as_it_says_for_models_that_are_alike() -> None:
    rng, held = np.random.default_rng(1), 0
    for _ in range(200):
        low, high = error_ratio(*rng.normal(size=(2, 600)), np.arange(600) // 20).interval or (0.0, 0.0)
        held += low < 1 < high
    assert 0.9 <= held / 200 <= 0.99


def test_identify_and_plain_least_squares_are_judged_on_the_same_torque(tmp_path: Path) -> None:
    folder = recording_in(tmp_path / "recording", frame(0), frame(1))
    errors = measure_errors(folder, tmp_path / "verdict", 20.0)
    assert errors.notes == ("diagnose: it found no model",)
    assert [each.joint for each in errors.joints] == [1, 2, 3]
    for each in errors.joints:
        assert set(each.percent) == {"identify"}
        assert each.plain == pytest.approx(each.percent["identify"] / each.ratio["identify"].value)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--part", "folders"], "set ARMLAB_RECORDINGS to the folder that holds the recordings"),
        (["--part", "public", "--facts", "facts.yaml"], "--facts are about folders"),
        (["--only", "em"], "unknown recording 'em': did you mean 'emps'?"),
        (["--leave-one-out", "--part", "folders"], "--leave-one-out takes public recordings alone"),
        (["--part", "pieces", "--peers", "python"], "--peers are run on public recordings"),
    ],
)
def test_options_that_do_not_fit_are_refused_in_one_line(
    arguments: list[str], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(LOCAL_COPIES_VARIABLE, raising=False)
    done = CliRunner().invoke(main, ["proof", "real", *arguments])
    assert done.exit_code == 2
    assert message in done.output
