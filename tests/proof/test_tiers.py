"""A proof tier by tier: which sets each tier gets, and where they stand."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click import Choice

from armlab.cli.proof import prove
from armlab.common.errors import InputError
from armlab.proof.blind.sealed import FINISHED_MARK, SealedTier, judged_seed
from armlab.proof.tiers import tiers
from armlab.proof.tiers.changes import PairSet
from armlab.proof.tiers.motion import MotionSet
from armlab.proof.tiers.reading import SetupSet
from armlab.proof.tiers.real import RealSet
from armlab.proof.tiers.tiers import JUDGED, QUICK, QUICK_SEED, TIERS, USUAL_TIERS, Proof, choose_proof, prove_tiers
from armlab.proof.tiers.torque import SetSettings


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
    commit = "a" * 40
    proof = Proof(commit, judged_seed(commit), commit)
    list(prove_tiers(proof, USUAL_TIERS, tmp_path / "work", tmp_path / "results", 1))
    (torque, work, _), (setup, _, setup_results), (motion, _, _), (real, _, _) = asked
    assert {name: (each.cases, each.seed) for name, each in torque.items()} == {
        "mixed": (400, judged_seed(commit)),
        "nulls": (600, judged_seed(commit)),
    }
    assert work == tmp_path / "work" / "torque"
    assert setup == SetupSet(300, 200, 300, judged_seed(commit))
    assert motion == MotionSet(300, 300, judged_seed(commit))
    assert (real.cases, real.seed, len(real.recordings)) == (16, judged_seed(commit), 5)
    assert setup_results == tmp_path / "results" / "setup"


def test_a_finished_tier_that_is_not_judged_starts_anew(asked: list[Any], tmp_path: Path) -> None:
    proof = choose_proof(True, None, {}, ())
    list(prove_tiers(proof, ["motion"], tmp_path, tmp_path / "results", 1))
    assert (tmp_path / "motion" / FINISHED_MARK).is_file()
    (tmp_path / "motion" / "old").touch()
    list(prove_tiers(proof, ["motion"], tmp_path, tmp_path / "results", 1))
    assert not (tmp_path / "motion" / "old").exists()
    assert asked[0][0].cases < 10


def test_a_quick_look_at_real_recordings_is_a_case_each_of_two(asked: list[Any], tmp_path: Path) -> None:
    list(prove_tiers(choose_proof(True, None, {}, ()), ["real"], tmp_path, tmp_path / "results", 1))
    assert asked[0][0] == RealSet(("emps", "staubli-tx40"), 1, QUICK_SEED)


def test_a_tier_that_is_skipped_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(tiers, "prove_real", lambda *_: iter(["skipped"]))
    quick = choose_proof(True, None, {}, ())
    assert list(prove_tiers(quick, ("real",), tmp_path / "work", tmp_path, 1)) == ["tier real", "skipped"]
    assert not (tmp_path / "work").exists()


def test_a_size_replaces_that_kind_of_cases_in_each_tier_that_has_it(asked: list[Any], tmp_path: Path) -> None:
    proof = choose_proof(False, 1200, {"cases": 4, "nulls": 0, "field_nulls": 5, "field_changed": 6}, ())
    list(prove_tiers(proof, ("torque", "motion", "changes"), tmp_path, tmp_path / "results", 1))
    (torque, *_), (motion, *_), (changes, *_) = asked
    assert torque == {"mixed": SetSettings(4, 1200, development=True)}
    assert motion == MotionSet(4, 0, 1200)
    assert changes == PairSet(0, 120, 5, 6, 1200)
    assert proof.commit is None


def test_a_kind_of_cases_that_no_tier_has_is_refused(tmp_path: Path) -> None:
    proof = choose_proof(True, None, {"pairs": 3}, ())
    with pytest.raises(InputError, match="--size pairs: cases of the tiers setup, motion are cases, nulls, real, "):
        list(prove_tiers(proof, ("setup", "motion"), tmp_path, tmp_path, 1))


def test_every_tier_has_its_numbers_of_cases_and_the_command_offers_it() -> None:
    offered = next(each for each in prove.params if each.name == "tiers")
    assert JUDGED.keys() == QUICK.keys() == set(TIERS)
    assert isinstance(offered.type, Choice)
    assert tuple(offered.type.choices) == TIERS


def test_a_seed_that_is_not_for_development_is_refused() -> None:
    with pytest.raises(InputError, match="seed 5000 should be one for development, 1000 to 1999"):
        choose_proof(False, 5000, {}, ())
