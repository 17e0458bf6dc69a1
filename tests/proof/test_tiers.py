"""A proof tier by tier: which sets each tier gets, and where they stand."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from armlab.proof.blind.sealed import FINISHED_MARK, SealedTier, judged_seed
from armlab.proof.tiers import tiers
from armlab.proof.tiers.motion import MotionSet
from armlab.proof.tiers.reading import SetupSet
from armlab.proof.tiers.real import RealSet
from armlab.proof.tiers.tiers import TIERS, prove_tiers
from armlab.proof.tiers.torque import QUICK_SEED, Proof


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Any, Path, Path]]:
    """Stands in for every tier; lists what each was given."""
    given: list[tuple[Any, Path, Path]] = []

    def stand_in(settings: Any, work: Path, results: Path, jobs: int, commit: str | None = None) -> Iterator[str]:
        given.append((settings, work, results))
        work.mkdir(parents=True, exist_ok=True)
        yield "done"

    for name in ("prove_torque", "prove_real"):
        monkeypatch.setattr(tiers, name, stand_in)
    monkeypatch.setattr(SealedTier, "prove", lambda _, *arguments: stand_in(*arguments))
    return given


def test_each_tier_has_its_folder_and_all_have_one_judged_seed(asked: list[Any], tmp_path: Path) -> None:
    proof, commit = Proof({}, "judged", "a" * 40), "a" * 40
    list(prove_tiers(proof, TIERS, tmp_path / "work", tmp_path / "results", 1))
    (torque, work, _), (setup, _, setup_results), (motion, _, _), (real, _, _) = asked
    assert torque is proof
    assert work == tmp_path / "work" / "torque"
    assert setup == SetupSet(300, 200, 300, judged_seed(commit))
    assert motion == MotionSet(300, 300, judged_seed(commit))
    assert (real.cases, real.seed, len(real.recordings)) == (16, judged_seed(commit), 5)
    assert setup_results == tmp_path / "results" / "setup"


def test_a_finished_tier_that_is_not_judged_starts_anew(asked: list[Any], tmp_path: Path) -> None:
    proof = Proof({}, "quick")
    list(prove_tiers(proof, ["motion"], tmp_path, tmp_path / "results", 1))
    assert (tmp_path / "motion" / FINISHED_MARK).is_file()
    (tmp_path / "motion" / "old").touch()
    list(prove_tiers(proof, ["motion"], tmp_path, tmp_path / "results", 1))
    assert not (tmp_path / "motion" / "old").exists()
    assert asked[0][0].cases < 10


def test_a_quick_look_at_real_recordings_is_a_case_each_of_two(asked: list[Any], tmp_path: Path) -> None:
    list(prove_tiers(Proof({}, "quick"), ["real"], tmp_path, tmp_path / "results", 1))
    assert asked[0][0] == RealSet(("emps", "staubli-tx40"), 1, QUICK_SEED)


def test_a_tier_that_is_skipped_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tiers, "prove_real", lambda *_: iter(["skipped"]))
    assert list(prove_tiers(Proof({}, "quick"), ("real",), tmp_path / "work", tmp_path, 1)) == ["tier real", "skipped"]
    assert not (tmp_path / "work").exists()
