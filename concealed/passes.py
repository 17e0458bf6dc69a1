"""From a plan to tracks: effects are sized on the reference, played coarsely, corrected, then played finely."""

from dataclasses import dataclass

from concealed.effects.hidden import Hidden
from concealed.plan import Plan
from concealed.play import play, thinned, wanted_track
from concealed.simulate import draw_controller
from concealed.sizing import Sized, drawn, multiples, resized
from concealed.track import Track


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
        sized = resized(plan, sized, coarse)
    fine = play(plan, sized.hidden, controller, coarse, wanted)
    return Simulated(plan, sized, fine, multiples(plan, sized.hidden, fine))
