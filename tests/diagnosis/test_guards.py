"""Guards of the diagnosis as switches."""

from pathlib import Path

import engine_cases as cases
import pytest
from click.testing import CliRunner

from armlab.cli.main import main
from armlab.common.errors import InputError
from armlab.diagnosis.ablation import ALL_ON, GUARDS_AFTER_SEARCH, GUARDS_IN_SEARCH, diagnose_without_each
from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import GUARDS, Guards, Settings, guards_without, vary
from armlab.diagnosis.tuning import parse_change


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


def test_stages_that_a_guard_or_a_number_has_no_part_in_need_not_be_done_again() -> None:
    recording = cases.recording(lambda motion, time: 0.05 * motion.velocity**3, seconds=6.0)
    late, early = "pruning.least_gain=1e9", "data.rows_per_cutoff=3"  # used after the search, and before it
    found = dict(diagnose_without_each(recording, (late, early)))
    assert list(found) == [ALL_ON, *GUARDS, late, early]
    for change in (late, early):
        alone = diagnose(recording, settings=vary(Settings(), *parse_change(change)))
        assert _told(found[change]) == _told(alone), change
    assert _told(found[ALL_ON]) == _told(diagnose(recording))
    for guard in (GUARDS_AFTER_SEARCH[2], GUARDS_IN_SEARCH[0]):
        alone = diagnose(recording, settings=Settings(guards=guards_without([guard])))
        assert _told(found[guard]) == _told(alone), guard


def test_an_ablation_refuses_a_number_that_there_is_not_before_it_starts(tmp_path: Path) -> None:
    result = CliRunner().invoke(main, ["ablate", "--work", str(tmp_path / "work"), "--vary", "noise.order=8"])
    assert result.exit_code == 2
    assert "noise.order: no such tuning number, did you mean 'noise.max_order'?" in result.output
    assert not (tmp_path / "work").exists()
