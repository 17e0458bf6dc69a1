"""`armlab tools scale` counts what kills cost, and what sweeps take; the long runs are its own, these are small."""

from pathlib import Path

import pytest

from armlab.common.errors import InputError
from bench.studies.scale.kills import KillResult, Victim, kill_repeatedly
from bench.studies.scale.scale_page import kills_page, scale_page
from bench.studies.scale.sweeps import ScaleCost, SweepCost, WatchedCommand, watch_command, write_sized_config

CONFIGS = Path(__file__).parents[2] / "configs"


@pytest.mark.parametrize("victim", ["driver", "worker"])
def test_a_kill_at_a_random_time_loses_nothing_and_the_restart_is_exact(victim: Victim, tmp_path: Path) -> None:
    config = tmp_path / "kills.yaml"
    text = (CONFIGS / "scale_kills.yaml").read_text()
    assert "repetitions: 100" in text
    config.write_text(text.replace("repetitions: 100", "repetitions: 30"))
    told: list[str] = []
    (kill,) = kill_repeatedly(config, 1, victim, told.append)
    assert kill.exact
    assert 0 < kill.kept <= 120
    assert len(told) == 1


def test_a_loss_or_a_trial_that_is_computed_again_is_not_exact() -> None:
    assert KillResult(kept=3, lost=0, missing=2, computed=2, store_and_table_intact=True).exact
    assert not KillResult(kept=3, lost=1, missing=2, computed=2, store_and_table_intact=True).exact
    assert not KillResult(kept=3, lost=0, missing=2, computed=3, store_and_table_intact=True).exact
    assert not KillResult(kept=3, lost=0, missing=2, computed=2, store_and_table_intact=False).exact
    assert "| driver | 1 | 3 | 1 | 2 | 0 of 1 |" in kills_page({"driver": [KillResult(3, 1, 2, 2, True)]})


def test_a_sweep_of_a_size_has_as_many_repetitions_as_make_it(tmp_path: Path) -> None:
    assert "repetitions: 30" in write_sized_config(CONFIGS / "scale.yaml", 3000, tmp_path).read_text()
    with pytest.raises(InputError, match="multiple of 100"):
        write_sized_config(CONFIGS / "scale.yaml", 3050, tmp_path)


def test_the_memory_and_the_end_of_a_command_are_seen(tmp_path: Path) -> None:
    seen = watch_command(["bench", "list"], tmp_path)
    assert seen.seconds > 0
    assert 5 < seen.peak < 1000
    assert seen.after(0.0) == seen.memory[0]
    assert seen.after(1.0) == seen.memory[-1]


def test_overhead_is_what_the_workers_spend_beside_the_searches() -> None:
    run, again = WatchedCommand(12.0, (100.0, 110.0)), WatchedCommand(2.0, (90.0,))
    sweep = SweepCost(trials=1000, workers=2, run=run, repeated=again, report=None, search_seconds=15.0)
    assert sweep.trial_seconds == 10.0
    assert sweep.overhead_ms == pytest.approx(5.0)  # 2 x 10 s of two cores, 15 s of them searches, over 1,000
    scale = ScaleCost(sweep, sweep, alone=18.0, together=10.0, load=2.0)
    assert scale.efficiency == pytest.approx(0.9)
    assert "an efficiency of 90%" in scale_page(scale)
