"""Brings the hidden effects of a case to the sizes that are aimed at."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from concealed.effects.hidden import Hidden
from concealed.limit import ORACLE_HZ, Oracle
from concealed.plan import Plan, draw_effects, target_multiple
from concealed.play import true_arm
from concealed.shares import free_columns, share_of, taken
from concealed.track import Track
from recordings.run import Array

ATTEMPTS = 6  # draws of effects that cannot be seen on this arm, before one is taken as it is
SEEN = 0.6  # of the multiple aimed at
STEPS, CLOSE = 4, 0.03  # of the search for a size, and when it ends
POWERS, FARTHEST = (0.25, 3.0), 1e3  # of the size that a multiple may follow, and the longest step


@dataclass(frozen=True, eq=False)
class Sized:
    """Effects with their sizes. targets: multiples aimed at. passed_over: names of draws that could not be seen."""

    hidden: tuple[Hidden, ...]
    targets: tuple[float, ...]
    passed_over: tuple[str, ...] = ()

    def with_size(self, number: int, size: float) -> "Sized":
        """The same with another size of one effect."""
        changed = self.hidden[number].sized(size)
        return replace(self, hidden=(*self.hidden[:number], changed, *self.hidden[number + 1 :]))


def drawn(plan: Plan, tracks: Sequence[Track]) -> Sized:
    """Effects of the sizes aimed at, found on the reference tracks; drawn anew where they could not be seen.

    The last draw is kept whatever it is.
    """
    oracle, passed_over = oracle_of(plan, tracks), list[str]()
    motors = [track.load + taken(plan.background, track, 0) for track in _identifying(plan, tracks)]
    peak = np.max([np.abs(torque).max(axis=0) for torque in motors], axis=0)
    for attempt in range(ATTEMPTS):
        hidden = tuple(effect.informed(peak) for effect in draw_effects(plan, attempt))
        targets = tuple(target_multiple(plan, number) for number in range(len(hidden)))
        sized, seen = Sized(hidden, targets, tuple(passed_over)), True
        for number, target in enumerate(targets):
            sized, found = _brought_to(plan, oracle, sized, number, tracks, target)
            seen = seen and found > SEEN * target
        if seen:
            break
        passed_over += [effect.effect for effect in hidden]
    return sized


def resized(plan: Plan, sized: Sized, tracks: Sequence[Track]) -> Sized:
    """Corrected on simulated tracks: slow motions may do otherwise than thought. What has parts stays as it is."""
    oracle = oracle_of(plan, tracks)
    for number, target in enumerate(sized.targets):
        sized, _ = _brought_to(plan, oracle, sized, number, tracks, target)
    return sized


def next_size(tried: Sequence[tuple[float, float]], target: float) -> float:
    """Where a power law through the last two tries (size, multiple) has the multiple aimed at; a line after one."""
    size, found = tried[-1]
    power = 1.0
    if len(tried) > 1 and tried[-2][0] != size:
        before, then = tried[-2]
        power = float(np.clip(np.log(found / then) / np.log(size / before), *POWERS))
    return float(size * np.clip((target / found) ** (1 / power), 1 / FARTHEST, FARTHEST))


def multiples(plan: Plan, hidden: Sequence[Hidden], tracks: Sequence[Track]) -> tuple[float, ...]:
    """Detection limits of each effect on the tracks of all runs."""
    oracle = oracle_of(plan, tracks)
    return tuple(multiple_of(plan, oracle, hidden, number, tracks) for number in range(len(hidden)))


def oracle_of(plan: Plan, tracks: Sequence[Track]) -> Oracle:
    """Knows the noise; in the realistic tier base parameters and friction of every joint are free."""
    oracle = Oracle(plan.noise, plan.rate_hz)
    if not plan.realistic:
        return oracle
    return oracle.freed([free_columns(plan.true_arm, track, _grid(track)) for track in _identifying(plan, tracks)])


def multiple_of(plan: Plan, oracle: Oracle, hidden: Sequence[Hidden], number: int, tracks: Sequence[Track]) -> float:
    """Detection limits of one effect among others; in the clean tier its own plain friction is free beside it."""
    effect, rest = hidden[number], (*hidden[:number], *hidden[number + 1 :])
    arms, runs = (true_arm(plan, hidden), true_arm(plan, rest)), _identifying(plan, tracks)
    others = (*plan.background, *rest)
    shares = [share_of(effect, others, arms, track, run, _grid(track)) for run, track in enumerate(runs)]
    if plan.realistic or not effect.companions:
        return oracle.multiple(shares)
    columns = [free_columns(plan.true_arm, track, _grid(track), friction_only=True) for track in runs]
    chosen = [effect.joint + len(plan.true_arm) * ("coulomb", "viscous").index(name) for name in effect.companions]
    return oracle.multiple(shares, [each[..., chosen] for each in columns])


def _brought_to(
    plan: Plan, oracle: Oracle, sized: Sized, number: int, tracks: Sequence[Track], target: float
) -> tuple[Sized, float]:
    """One effect brought to a multiple; those with parts of their own need a simulation and stay as they are."""
    if sized.hidden[number].has_parts:
        return sized, target
    found = multiple_of(plan, oracle, sized.hidden, number, tracks)
    for _ in range(STEPS):
        factor = float(np.clip(target / max(found, 1e-9), 1e-3, 1e3))
        if abs(np.log(factor)) < CLOSE:
            break
        sized = sized.with_size(number, sized.hidden[number].size * factor)
        found = multiple_of(plan, oracle, sized.hidden, number, tracks)
    return sized, found


def _identifying(plan: Plan, tracks: Sequence[Track]) -> list[Track]:
    """The tracks from which a diagnosis may learn."""
    return [track for track, run in zip(tracks, plan.runs, strict=True) if run.role == "identify"]


def _grid(track: Track) -> Array:
    return np.asarray(np.arange(0.0, track.time[-1] - 0.05, 1 / ORACLE_HZ))
