"""From a plan to tracks: effects are sized on the reference, played coarsely, corrected, then played finely.

What has parts of its own (a spring, a play, a base that gives way) shows its size in simulations alone, and not in
proportion: it is played coarsely as often as it takes.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from concealed.effects.hidden import Hidden
from concealed.plan import Plan
from concealed.play import play, thinned, wanted_track
from concealed.simulate import Controller, draw_controller
from concealed.sizing import Sized, drawn, multiple_of, multiples, next_size, oracle_of, resized
from concealed.track import Track

COARSE_PASSES, HALVINGS = 6, 3
NEAR = 0.1  # of the logarithm of the multiple aimed at


@dataclass(frozen=True, eq=False)
class Simulated:
    """A case's runs as they happened, before any channel recorded them. multiples: of each effect's limit."""

    plan: Plan
    sized: Sized
    tracks: tuple[Track, ...]
    multiples: tuple[float, ...]

    @property
    def hidden(self) -> tuple[Hidden, ...]:
        """The hidden effects with their final sizes."""
        return self.sized.hidden

    @property
    def everything(self) -> tuple[Hidden, ...]:
        """Background and hidden effects."""
        return (*self.plan.background, *self.hidden)


def simulated(plan: Plan, given: tuple[Hidden, ...] | None = None) -> Simulated:
    """Simulates a case, with the effects that its plan draws or with given ones of given sizes."""
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    wanted = [wanted_track(plan, number, run) for number, run in enumerate(plan.runs)]
    sized = drawn(plan, wanted) if given is None else Sized(given, tuple(0.0 for _ in given))
    coarse = play(plan, sized.hidden, controller, wanted, [thinned(track) for track in wanted])
    if given is None:
        sized, coarse = corrected(plan, sized, controller, wanted, coarse)
    fine = play(plan, sized.hidden, controller, coarse, wanted)
    return Simulated(plan, sized, fine, multiples(plan, sized.hidden, fine))


def corrected(
    plan: Plan, sized: Sized, controller: Controller, wanted: Sequence[Track], coarse: tuple[Track, ...]
) -> tuple[Sized, tuple[Track, ...]]:
    """Sizes as near to the multiples aimed at as coarse tracks show, and the last of these.

    coarse: as played with the sizes so far.
    """
    number = next((number for number, effect in enumerate(sized.hidden) if effect.has_parts), None)
    if number is not None:
        sized, coarse = _nearest(plan, sized, number, controller, wanted, coarse)
    return resized(plan, sized, coarse), coarse


def _nearest(
    plan: Plan,
    sized: Sized,
    number: int,
    controller: Controller,
    wanted: Sequence[Track],
    coarse: tuple[Track, ...],
) -> tuple[Sized, tuple[Track, ...]]:
    """The effect with parts at the size that comes nearest, and the tracks that it leads to."""
    target, tried = sized.targets[number], list[tuple[float, float]]()
    best = (np.inf, sized, coarse)
    for more in reversed(range(COARSE_PASSES)):
        found = max(multiple_of(plan, oracle_of(plan, coarse), sized.hidden, number, coarse), 1e-9)
        tried.append((sized.hidden[number].size, found))
        best = min(best, (abs(float(np.log(found / target))), sized, coarse), key=lambda each: each[0])
        aimed = sized.with_size(number, next_size(tried, target))
        if not more or best[0] < NEAR or aimed.hidden[number].size == tried[-1][0]:
            break
        played = _played(plan, sized, aimed, number, controller, wanted)
        if played is None:
            break
        sized, coarse = played
    return best[1], best[2]


def _played(
    plan: Plan, sized: Sized, aimed: Sized, number: int, controller: Controller, wanted: Sequence[Track]
) -> tuple[Sized, tuple[Track, ...]] | None:
    """Coarse tracks at the size aimed at, or on the way to it where the engine's step cannot follow that."""
    for _ in range(HALVINGS):
        try:
            return aimed, play(plan, aimed.hidden, controller, wanted, [thinned(track) for track in wanted])
        except FloatingPointError:
            middle = float(np.sqrt(sized.hidden[number].size * aimed.hidden[number].size))
            aimed = aimed.with_size(number, middle)
    return None
