"""The sealed protocol: the same set from the same seed, and a seal that shows every change."""

import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from made_verdicts import perfect, verdict, write

from armlab.cli.concealed import conceal as conceal_command
from armlab.cli.concealed import score as score_command
from armlab.common.errors import InputError
from armlab.proof.blind.formats import SetManifest, Truth, read_model
from armlab.proof.blind.noise import JUDGED_KINDS, USUAL_KINDS
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS, PLAN, draw_plan, target_multiple
from armlab.proof.blind.score.cases import FAILURE_FILE, read_complaint
from armlab.proof.blind.score.scoring import score_set
from armlab.proof.blind.sealed import DIGESTS, MANIFEST_FILE, VERDICTS, file_digest, judged_seed, read_checked_manifest
from armlab.proof.tiers.torque import TORQUE, SetSettings, make_set_settings
from armlab.recordings.load import load_recording

SETTINGS = SetSettings(3, 1005, "both", "mixed", True)


def make_set(settings: SetSettings, folder: Path, jobs: int) -> list[str]:
    """Conceals the missing cases and seals the set; the names of the cases that were made."""
    made = list(TORQUE.conceal(settings, folder, jobs))
    TORQUE.seal(settings, folder)
    return made


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("concealed") / "set"
    make_set(SETTINGS, folder, 1)
    return folder


@pytest.fixture
def copy(made: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(made, tmp_path / "set"))


def _verdicts(folder: Path, out: Path) -> Path:
    for path in (folder / "truth").glob("*.json"):
        write(out, path.stem, perfect(read_model(Truth, path)))
    return out


def test_a_set_is_the_same_to_the_byte_for_one_and_two_jobs(made: Path, tmp_path: Path) -> None:
    make_set(SETTINGS, tmp_path / "again", 2)
    assert file_digest(tmp_path / "again" / MANIFEST_FILE) == file_digest(made / MANIFEST_FILE)


def _interrupt(folder: Path) -> str:
    """As if the first case had only begun: its name."""
    name = sorted(path.name for path in (folder / "observations").iterdir())[0]
    (folder / MANIFEST_FILE).unlink()
    (folder / DIGESTS / f"{name}.json").unlink()
    return name


def test_an_interrupted_set_goes_on_where_it_stopped(copy: Path) -> None:
    sealed = file_digest(copy / MANIFEST_FILE)
    begun = _interrupt(copy)
    assert make_set(SETTINGS, copy, 1) == [begun]
    assert file_digest(copy / MANIFEST_FILE) == sealed


def test_an_incomplete_set_gets_no_seal(copy: Path) -> None:
    begun = _interrupt(copy)
    with pytest.raises(InputError, match=f"{begun}.json"):
        TORQUE.seal(SETTINGS, copy)
    assert not (copy / MANIFEST_FILE).exists()


def test_what_was_changed_before_the_seal_is_refused_too(copy: Path, tmp_path: Path) -> None:
    _interrupt(copy)
    changed = sorted((copy / "truth").glob("*.json"))[-1]
    changed.write_text(changed.read_text() + " ")
    make_set(SETTINGS, copy, 1)
    with pytest.raises(InputError, match=f"{changed.name} was changed after"):
        read_checked_manifest(copy, SetManifest)


def test_another_set_in_the_folder_is_refused(copy: Path) -> None:
    with pytest.raises(InputError, match="holds another set"):
        make_set(SetSettings(3, 1006), copy, 1)


@pytest.mark.parametrize("part", ["truth", "observations"])
def test_a_score_is_refused_where_a_file_was_changed_after_sealing(copy: Path, tmp_path: Path, part: str) -> None:
    file = next(path for path in sorted((copy / part).rglob("*")) if path.suffix in (".json", ".yaml"))
    file.write_text(file.read_text() + " ")
    with pytest.raises(InputError, match="was changed after"):
        score_set(copy, _verdicts(copy, tmp_path / "v"), None, tmp_path / "out")


def test_a_manifest_made_anew_is_refused_by_its_printed_hash(copy: Path) -> None:
    sealed = file_digest(copy / MANIFEST_FILE)
    (copy / MANIFEST_FILE).write_text((copy / MANIFEST_FILE).read_text().replace('"seed": 1005', '"seed": 1006'))
    with pytest.raises(InputError, match="is not the manifest that was sealed"):
        read_checked_manifest(copy, SetManifest, sealed)


def test_conceal_prints_the_hash_and_score_takes_it(made: Path, tmp_path: Path) -> None:
    arguments = ["--cases", "3", "--seed", "1005", "--development", "--out", str(made)]
    printed = CliRunner().invoke(conceal_command, arguments)
    assert file_digest(made / MANIFEST_FILE) in printed.output
    verdicts = _verdicts(made, tmp_path / "v")
    told = [str(made), "--verdicts", str(verdicts), "--manifest", file_digest(made / MANIFEST_FILE)]
    scored = CliRunner().invoke(score_command, told)
    assert scored.exit_code == 0, scored.output
    assert (verdicts / "score" / "score.json").is_file()


def test_observations_are_recordings_with_the_same_columns_and_no_word_of_the_answer(made: Path) -> None:
    for folder in (made / "observations").iterdir():
        assert len(load_recording(folder).with_role("validate")) == 1
        settings = yaml.safe_load((folder / "recording.yaml").read_text())
        assert set(settings["columns"]) == {"time", "position", "torque"}
        assert {path.name for path in folder.iterdir()} == {
            "recording.yaml",
            "robot.yaml",
            *(run["file"] for run in settings["runs"]),
        }


def test_the_robot_file_holds_the_nominal_links_and_not_the_true_ones(made: Path) -> None:
    for number in range(SETTINGS.cases):
        plan = SETTINGS.plan(number)
        arm = load_recording(made / "observations" / plan.name).arm
        np.testing.assert_allclose(arm.parameters, plan.machine.arm.parameters)
        assert arm.rotor_inertia == plan.machine.arm.rotor_inertia


def test_development_never_draws_the_noise_of_judged_nulls() -> None:
    kinds = {draw_plan(1000, index, "clean", True, True).noise.kind for index in range(150)}
    assert kinds == set(USUAL_KINDS)


def test_half_of_the_judged_nulls_have_noise_that_development_never_saw() -> None:
    kinds = [draw_plan(77, index, "realistic", True, False).noise.kind for index in range(300)]
    assert 0.4 < np.mean([kind in JUDGED_KINDS for kind in kinds]) < 0.6
    assert set(JUDGED_KINDS) < set(kinds)


def test_development_seeds_are_marked_whatever_was_asked() -> None:
    assert make_set_settings(1, 1500, "both", "mixed", False).development
    assert not make_set_settings(1, 5, "both", "mixed", False).development


def test_a_judged_seed_follows_from_the_commit_and_is_no_development_seed() -> None:
    first, second = judged_seed("0" * 40), judged_seed("f" * 40)
    assert first != second
    assert first not in DEVELOPMENT_SEEDS
    assert second not in DEVELOPMENT_SEEDS


def test_sizes_spread_evenly_from_half_a_limit_to_twenty() -> None:
    sizes = [target_multiple(draw_plan(1000, index, "clean", False, True), 0) for index in range(60)]
    assert PLAN.multiples[0] <= min(sizes) < 0.6
    assert 17 < max(sizes) <= 20
    counts, _ = np.histogram(np.log(sizes), bins=6, range=(np.log(0.5), np.log(20)))
    assert counts.min() >= 8


def test_realistic_links_are_three_to_ten_per_cent_off() -> None:
    plan = draw_plan(1000, 3, "realistic", True, True)
    assert all(0.03 <= error <= 0.1 for error in plan.cad_errors)
    assert len(plan.cad_errors) == plan.machine.joints
    assert {effect.effect for effect in plan.background} >= {"coulomb_friction", "viscous_friction"}


def test_a_diagnosis_that_fails_is_kept_as_failed(tmp_path: Path) -> None:
    plan = SETTINGS.plan(0)
    (tmp_path / "observations" / plan.name).mkdir(parents=True)
    assert list(TORQUE.ask([plan], tmp_path, 1)) == [plan.name]
    assert (tmp_path / VERDICTS / plan.name / FAILURE_FILE).is_file()
    assert list(TORQUE.ask([plan], tmp_path, 1)) == []


def test_a_complaint_is_one_line_without_the_paths_of_a_traceback(tmp_path: Path) -> None:
    assert read_complaint(tmp_path) == ""
    failure = tmp_path / FAILURE_FILE
    failure.write_text('Traceback\n  File "engine.py", line 3, in fit\nValueError: no solution\n\n')
    assert read_complaint(tmp_path) == "ValueError: no solution"
    failure.write_text("")
    assert read_complaint(tmp_path) == "no error output"


def test_missing_and_broken_verdicts_count_against_and_stop_nothing(made: Path, tmp_path: Path) -> None:
    cases = json.loads((made / MANIFEST_FILE).read_text())["cases"]
    write(tmp_path / "v", cases[0], verdict())
    write(tmp_path / "v", cases[1], "{ no json")
    found = score_set(made, tmp_path / "v", None, tmp_path / "out")
    counted = {
        tier: next(each for each in measures if each["id"] == "missing_verdicts")
        for tier, measures in found["tiers"].items()
    }
    assert sum(each["value"] * each["number"] for each in counted.values()) == 2


def test_no_verdict_at_all_is_refused(made: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no valid verdict"):
        score_set(made, tmp_path / "v", None, tmp_path / "out")
