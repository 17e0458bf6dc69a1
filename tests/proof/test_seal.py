"""The seal of every tier: no score of a set in which a file is not the one that was sealed."""

import shutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from made_cases import write_made_cases

from armlab.common.errors import InputError
from armlab.proof.blind.folders import claim_folder
from armlab.proof.blind.sealed import DRAFTS, OBSERVATIONS, TIME_FILE, TRUTH, VERDICTS, Score, SealedTier
from armlab.proof.tiers.changes import CHANGES, PairSet
from armlab.proof.tiers.field import FIELD_TIER, FieldSet
from armlab.proof.tiers.motion import MOTION, MotionSet
from armlab.proof.tiers.reading import SETUP, SetupSet
from armlab.proof.tiers.real import MADE, REAL, RealSet
from armlab.proof.tiers.torque import TORQUE, SetSettings

SMALLEST: dict[str, tuple[SealedTier[Any, Any], Any]] = {  # seeds of one null of an arm with two joints
    "torque": (TORQUE, SetSettings(1, 1017, "clean", "nulls", True)),
    "setup": (SETUP, SetupSet(0, 0, 1, 1013)),
    "motion": (MOTION, MotionSet(0, 1, 1025)),
    "changes": (CHANGES, PairSet(1, 0, 0, 0, 1017)),
    "real": (REAL, RealSet(("emps",), 0, 1001)),
    "field": (FIELD_TIER, FieldSet(0, 1, 0, 1000)),
}


@dataclass(frozen=True)
class AnsweredSet:
    """A sealed set with an empty verdict a case."""

    tier: SealedTier[Any, Any]
    settings: Any
    folder: Path

    def judge(self, results: Path) -> None:
        """Goes on with its proof, of which the score alone is left."""
        list(self.tier.prove(self.settings, self.folder, results, 1))


@pytest.fixture(scope="module", params=SMALLEST)
def sealed(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> AnsweredSet:
    tier, settings = SMALLEST[request.param]
    folder = tmp_path_factory.mktemp(request.param) / "work"
    names = [plan.name for plan in tier.draw(settings)]
    claim_folder(settings, folder)
    if tier is REAL:
        write_made_cases(folder / DRAFTS / MADE, "emps", settings.cases)
    assert list(tier.conceal(settings, folder, 1)) == names
    tier.seal(settings, folder)
    for name in names:
        (folder / VERDICTS / name).mkdir(parents=True)
        (folder / VERDICTS / name / TIME_FILE).write_text('{"seconds": 1}')
    return AnsweredSet(tier, settings, folder)


@pytest.fixture
def copy(sealed: AnsweredSet, tmp_path: Path) -> AnsweredSet:
    return replace(sealed, folder=Path(shutil.copytree(sealed.folder, tmp_path / "work")))


def _change_byte(file: Path) -> None:
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 1
    file.write_bytes(content)


def _add_beside(file: Path) -> None:
    file.with_name("another.json").write_text("{}")


@pytest.mark.parametrize("part", [OBSERVATIONS, TRUTH])
@pytest.mark.parametrize(
    ("harm", "what"), [(_change_byte, "changed"), (Path.unlink, "missing"), (_add_beside, "added")]
)
def test_a_set_with_a_file_that_was_not_sealed_is_refused_before_any_score(
    copy: AnsweredSet, part: str, harm: Callable[[Path], None], what: str, tmp_path: Path
) -> None:
    def judge(*_: object) -> Score:
        pytest.fail("an answer was read before the seal was checked")

    file = next(path for path in sorted((copy.folder / part).rglob("*")) if path.is_file())
    harm(file)
    named = "another.json" if harm is _add_beside else file.name
    with pytest.raises(InputError, match=f"{named} (was|is) {what} after manifest.json was sealed") as refused:
        replace(copy, tier=replace(copy.tier, judge=judge)).judge(tmp_path / "results")
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "results").exists()


def test_an_untouched_set_is_judged_by_its_answers(copy: AnsweredSet, tmp_path: Path) -> None:
    asked = []

    def judge(settings: object, work: Path, results: Path) -> Score:
        asked.append((settings, work, results))
        return Score((), 1, {})

    replace(copy, tier=replace(copy.tier, judge=judge)).judge(tmp_path / "results")
    assert asked == [(copy.settings, copy.folder, tmp_path / "results")]


def test_a_diagnosis_gets_one_observation_in_a_folder_without_answers(
    copy: AnsweredSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    given: list[str] = []

    def answer(arguments: Sequence[str], out: Path) -> None:
        paths = [Path(word) for word in arguments if Path(word).is_absolute()]
        assert paths
        assert all(path.is_dir() and not path.is_relative_to(copy.folder) for path in paths)
        given.extend(arguments)

    monkeypatch.setattr("armlab.proof.blind.sealed.answer", answer)
    shutil.rmtree(copy.folder / VERDICTS)
    list(copy.tier.ask(list(copy.tier.draw(copy.settings)), copy.folder, 1))
    assert given
