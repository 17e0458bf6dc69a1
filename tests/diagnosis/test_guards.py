"""Guards of the diagnosis as switches."""

from pathlib import Path

import engine_cases as cases
import pytest
from click.testing import CliRunner

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import GUARDS, Guards, Settings, guards_without, vary
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.tuning import parse_change
from armlab.proof.open import ablation
from armlab.proof.open.ablation import ALL_ON, GUARDS_AFTER_SEARCH, GUARDS_IN_SEARCH, diagnose_without_each


def test_a_guard_that_is_named_is_off_and_all_others_are_on() -> None:
    off = guards_without(["heldout_gain"])
    assert not off.heldout_gain
    assert all(getattr(off, name) for name in GUARDS if name != "heldout_gain")
    assert guards_without([]) == Guards()


def test_a_guard_that_there_is_not_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(InputError, match=r"--without held_out_gain: no such guard.*heldout_gain"):
        guards_without(["held_out_gain"])


def _told(found: Diagnosis) -> list[tuple[str, int | None, str]]:
    return [(each.effect, each.joint, each.equation) for each in found.claims]


LATE, EARLY = "pruning.level=1e-12", "data.rows_per_cutoff=3"  # used after the search, and before it


def test_each_guard_is_off_once_and_no_stage_before_its_own_is_done_again(monkeypatch: pytest.MonkeyPatch) -> None:
    stages = {
        "prepare": lambda *_: "design",
        "fit_background": lambda *_: ("background",),
        "_with_settings": lambda each, settings: (*each, settings),
        "search_effects": lambda each, _: (*each, "search"),
        "conclude_search": lambda recording, each, _: each,
        "diagnose": lambda recording, settings: ("all", settings),
    }
    for name, stage in stages.items():
        monkeypatch.setattr(ablation, name, stage)
    still = cases.recording(lambda motion, time: 0 * motion.velocity, seconds=1.0)
    found = dict(diagnose_without_each(still, (LATE, EARLY)))
    assert list(found) == [ALL_ON, *GUARDS, LATE, EARLY]
    assert found.pop(ALL_ON) == ("background", "search")
    changed = {change: vary(Settings(), *parse_change(change)) for change in (LATE, EARLY)}
    for name, done in found.items():
        off = changed[name] if name in changed else Settings(guards=guards_without([name]))
        if name in (*GUARDS_AFTER_SEARCH, LATE):
            assert done == ("background", "search", off), name
        elif name in GUARDS_IN_SEARCH:
            assert done == ("background", off, "search"), name
        else:
            assert done == ("all", off), name


def test_stages_that_a_guard_or_a_number_has_no_part_in_need_not_be_done_again(monkeypatch: pytest.MonkeyPatch) -> None:
    guards = (GUARDS_AFTER_SEARCH[2], GUARDS_IN_SEARCH[0])
    monkeypatch.setattr(ablation, "GUARDS", guards)
    recording = cases.recording(lambda motion, time: motion.velocity**3 * [0, 0, 0.5], seconds=3.0)
    found = dict(diagnose_without_each(recording, (LATE,)))
    assert _told(found[LATE]) == _told(diagnose(recording, settings=vary(Settings(), *parse_change(LATE))))
    assert _told(found[ALL_ON]) == _told(diagnose(recording))
    for guard in guards:
        alone = diagnose(recording, settings=Settings(guards=guards_without([guard])))
        assert _told(found[guard]) == _told(alone), guard


def test_an_ablation_refuses_a_number_that_there_is_not_before_it_starts(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["proof", "ablate", "--work", str(tmp_path / "work"), "--vary", "noise.order=8"])
    assert result.exit_code == 2
    assert "noise.order: no such tuning number, did you mean 'noise.max_order'?" in result.output
    assert not (tmp_path / "work").exists()
