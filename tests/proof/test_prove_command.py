"""The proof as a whole, with a diagnosis that always says the same: what is kept, what is logged, what starts anew."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from made_verdicts import finding, verdict, write

from armlab.proof.blind.log_page import LOG_FILE
from armlab.proof.blind.plan import Plan
from armlab.proof.blind.score.measures import MEASURE_TEXTS
from armlab.proof.blind.sealed import VERDICTS, SealedTier
from armlab.proof.tiers.guards import AblationSettings, ablate
from armlab.proof.tiers.tiers import choose_proof, prove_tiers
from armlab.proof.tiers.torque import SetSettings, prove_torque

SETS = {"mixed": SetSettings(1, 5000, "clean", "nulls")}


@pytest.fixture
def silent(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Stands in for all diagnoses; lists the cases that were looked at."""
    looked: list[str] = []

    def ask(_: Any, plans: Sequence[Plan], folder: Path, jobs: int) -> Iterator[str]:
        for plan in plans:
            write(folder / VERDICTS, plan.name, verdict())
            looked.append(plan.name)
            yield plan.name

    monkeypatch.setattr(SealedTier, "ask", ask)
    return looked


def test_a_judged_proof_is_logged_once_with_commit_seed_seal_and_score(silent: list[str], tmp_path: Path) -> None:
    said = list(prove_torque(SETS, tmp_path / "work", tmp_path / "results", 1, "a" * 40))
    list(prove_torque(SETS, tmp_path / "work", tmp_path / "results", 1, "a" * 40))
    entries = [json.loads(line) for line in (tmp_path / "results" / LOG_FILE).read_text().splitlines()]
    assert len(entries) == 1
    assert entries[0]["commit"] == "a" * 40
    assert entries[0]["seed"] == 5000
    assert any(entries[0]["manifest"] in line for line in said)
    assert entries[0]["score"]["clean"]["false_claims_on_nulls"][0] == 0


def test_the_committed_log_selects_measures_by_id() -> None:
    log = Path(__file__).parents[2] / "results/proof" / LOG_FILE
    for line in log.read_text(encoding="utf-8").splitlines():
        entry = json.loads(line)
        for measures in entry["score"].values():
            if entry["set"] in ("mixed", "nulls"):
                assert measures.keys() <= MEASURE_TEXTS.keys()
            assert all(name.isidentifier() for name in measures)


def test_sets_that_are_proved_one_after_another_are_logged_each(silent: list[str], tmp_path: Path) -> None:
    for name in ("mixed", "nulls"):
        list(prove_torque({name: SETS["mixed"]}, tmp_path / "work", tmp_path / "results", 1, "c" * 40))
    entries = [json.loads(line) for line in (tmp_path / "results" / LOG_FILE).read_text().splitlines()]
    assert [each["set"] for each in entries] == ["mixed", "nulls"]


def test_the_seal_is_printed_before_the_first_diagnosis(silent: list[str], tmp_path: Path) -> None:
    steps = prove_torque(SETS, tmp_path / "work", tmp_path / "results", 1, "b" * 40)
    for line in steps:
        if "SHA-256" in line:
            break
    assert silent == []
    list(steps)
    assert len(silent) == 1


def test_a_finished_quick_proof_starts_anew_and_is_not_logged(silent: list[str], tmp_path: Path) -> None:
    proof = choose_proof(True, None, {"cases": 1}, ())
    for _ in range(2):
        list(prove_tiers(proof, ["torque"], tmp_path / "work", tmp_path / "results", 1))
    assert len(silent) == 2
    assert not (tmp_path / "results" / LOG_FILE).exists()


def test_an_ablation_scores_the_same_cases_with_each_guard_off(tmp_path: Path) -> None:
    asked: list[str] = []

    def diagnose(observation: Path) -> dict[str, dict[str, Any]]:
        asked.append(observation.name)
        wrong = verdict("mismatch", (finding("viscous_friction", 2),))
        return {"all guards on": verdict(), "robust_variance": verdict(), "correction": wrong}

    told = list(ablate(AblationSettings(1300, 1, 1), diagnose, tmp_path / "work", tmp_path / "results", 1))
    assert len(set(asked)) == len(asked) == 2
    assert told[-1] == f"wrote {tmp_path / 'results' / 'guards.md'}"
    rows = (tmp_path / "results" / "guards.md").read_text().splitlines()
    shares = {row.split(" | ")[0]: row.split(" | ")[1] for row in rows if " of 1" in row}
    assert shares == {"| all guards on": "0 of 1", "| robust variance": "0 of 1", "| correction": "1 of 1"}
