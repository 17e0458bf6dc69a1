"""Hidden effects come as large as they were aimed at, those with parts of their own too."""

import numpy as np
import pytest
from hidden_cases import plan

from concealed import passes
from concealed.effects.drives import Backlash, Elasticity
from concealed.effects.hidden import Hidden
from concealed.passes import corrected
from concealed.play import play, thinned, wanted_track
from concealed.simulate import draw_controller
from concealed.sizing import Sized, multiples, next_size


def _multiple(hidden: Hidden, target: float) -> float:
    made = plan()
    controller = draw_controller(made.stream("controller"), made.machine.arm)
    wanted = [wanted_track(made, number, run) for number, run in enumerate(made.runs)]
    coarse = play(made, (hidden,), controller, wanted, [thinned(track) for track in wanted])
    sized, coarse = corrected(made, Sized((hidden,), (target,)), controller, wanted, coarse)
    return multiples(made, sized.hidden, coarse)[0]


def test_a_gap_whose_torque_does_not_grow_in_proportion_meets_its_aim() -> None:
    gap = Backlash(1, 1e-3, 2e-2, "gap", {"hz": 80.0, "stiffness": 2e4})
    assert _multiple(gap, 6.0) == pytest.approx(6.0, rel=0.15)


def test_a_spring_that_cannot_be_as_soft_stays_at_its_bound() -> None:
    spring = Elasticity(0, 3e-5, 4e-5, "linear", {"damping": 2e-4})
    assert 0 < _multiple(spring, 20.0) < 15.0


def test_where_the_engine_cannot_follow_the_nearest_so_far_is_taken(monkeypatch: pytest.MonkeyPatch) -> None:
    def runs_away(*_: object) -> None:
        raise FloatingPointError("the simulated arm runs away")

    made, gap = plan(), Backlash(1, 1e-3, 2e-2, "gap", {"hz": 80.0, "stiffness": 2e4})
    controller = draw_controller(made.stream("controller"), made.machine.arm)
    wanted = [wanted_track(made, number, run) for number, run in enumerate(made.runs)]
    coarse = play(made, (gap,), controller, wanted, [thinned(track) for track in wanted])
    monkeypatch.setattr(passes, "play", runs_away)
    sized, kept = corrected(made, Sized((gap,), (1.0,)), controller, wanted, coarse)
    assert sized.hidden == (gap,)
    assert kept is coarse


def test_the_next_size_follows_a_power_law_through_the_last_two() -> None:
    assert next_size([(2.0, 10.0)], 5.0) == pytest.approx(1.0)
    square = [(size, size**2) for size in (8.0, 4.0)]
    assert next_size(square, 4.0) == pytest.approx(2.0)
    assert np.isfinite(next_size([(1.0, 5.0), (2.0, 5.0)], 1.0))
