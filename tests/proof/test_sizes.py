"""Hidden effects come as large as they were aimed at, those with parts of their own too."""

from dataclasses import dataclass

import numpy as np
import pytest
from hidden_cases import plan

from armlab.proof.blind import sizing
from armlab.proof.blind.effects.drives import Backlash, Elasticity
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.engine import Track
from armlab.proof.blind.plan import Plan
from armlab.proof.blind.simulate import Controller, coarse_track, draw_controller, reference_track, simulate_runs
from armlab.proof.blind.sizing import SizedEffects, correct_sizes, effect_multiples, next_size

GAP = Backlash(1, 1e-3, 2e-2, "gap", {"hz": 80.0, "stiffness": 2e4})


@dataclass(frozen=True, eq=False)
class Coarse:
    """A case with one effect, as it was played coarsely for the first time."""

    plan: Plan
    hidden: HiddenEffect
    controller: Controller
    wanted: list[Track]
    tracks: tuple[Track, ...]

    def corrected(self, target: float) -> tuple[HiddenEffect, tuple[Track, ...]]:
        sized = SizedEffects((self.hidden,), (target,))
        sized, tracks = correct_sizes(self.plan, sized, self.controller, self.wanted, self.tracks)
        return sized.hidden[0], tracks


def coarse(hidden: HiddenEffect) -> Coarse:
    made = plan()
    controller = draw_controller(made.stream("controller"), made.machine.arm)
    wanted = [reference_track(made, number, run) for number, run in enumerate(made.runs)]
    tracks = simulate_runs(made, (hidden,), controller, wanted, [coarse_track(track) for track in wanted])
    return Coarse(made, hidden, controller, wanted, tracks)


def test_a_gap_whose_torque_does_not_grow_in_proportion_meets_its_aim() -> None:
    first = coarse(GAP)
    gap, tracks = first.corrected(6.0)
    assert effect_multiples(first.plan, (gap,), tracks)[0] == pytest.approx(6.0, rel=0.15)


def test_a_spring_that_cannot_be_as_soft_stays_at_its_bound() -> None:
    spring, _ = coarse(Elasticity(0, 3e-5, 4e-5, "linear", {"damping": 2e-4})).corrected(20.0)
    assert spring.size == 4e-5


def test_where_the_engine_cannot_follow_the_nearest_so_far_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    def runs_away(*_: object) -> None:
        raise FloatingPointError("the simulated arm runs away")

    first = coarse(GAP)
    monkeypatch.setattr(sizing, "simulate_runs", runs_away)
    gap, tracks = first.corrected(1.0)
    assert gap == GAP
    assert tracks is first.tracks


def test_what_the_engine_warns_of_is_an_error_and_no_output(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(FloatingPointError, match="runs away"):
        coarse(Elasticity(2, 1e-6, 2e-6, "linear", {"damping": 2e-4}))
    assert capfd.readouterr() == ("", "")


def test_the_next_size_follows_a_power_law_through_the_last_two() -> None:
    assert next_size([(2.0, 10.0)], 5.0) == pytest.approx(1.0)
    square = [(size, size**2) for size in (8.0, 4.0)]
    assert next_size(square, 4.0) == pytest.approx(2.0)
    assert np.isfinite(next_size([(1.0, 5.0), (2.0, 5.0)], 1.0))
