"""Sizes of hidden effects: the detection limit, and the search for the size that has a given multiple of it.

The limit is the size that an oracle finds with 90 % power. The oracle knows the true law and the true noise. It tests
one number, the size of the effect, in whitened rows from which all free columns are projected out. Where a joint
stands still, its friction takes any value up to its level, and no motion tells which: such rows are bridged by straight
lines and count nothing. The level of its
test is 1 % over all effects and places that a diagnosis may look at. The *multiple* of an effect is

    multiple = sqrt(noncentrality of the effect / noncentrality of the limit).

Effects get their sizes on the reference; a coarse simulation corrects them; a fine simulation makes the recording. An
effect with parts of its own (a spring, a gap, a base that gives way) does not grow in proportion to its size, so it
needs several coarse simulations.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import chi2, ncx2

from armlab.common.arrays import Array
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.library import LIBRARY
from armlab.proof.blind.encoder_noise import EncoderNoise, whiten_with_encoders, whitening_filter
from armlab.proof.blind.engine import Track
from armlab.proof.blind.noise import Noise
from armlab.proof.blind.plan import Plan, draw_effects, target_multiple
from armlab.proof.blind.simulate import (
    Controller,
    RunWithout,
    arm_with_effects,
    coarse_track,
    draw_controller,
    effect_torque,
    free_columns,
    law_torque,
    reference_track,
    simulate_runs,
)


@dataclass(frozen=True)
class OracleSettings:
    """The definition of the detection limit; chosen before any diagnosis was scored.

    rate_hz: rows a second, each a mean over several samples. family_wise_level: chance of a false alarm over all
    effects and places. power: chance to find an effect of one limit. min_column_power: smallest share of the power of
    free columns that counts as more than rounding. end_s: time left out at the end of a run, s.
    """

    rate_hz: float = 250.0
    family_wise_level: float = 0.01
    power: float = 0.9
    min_column_power: float = 1e-10
    end_s: float = 0.05


@dataclass(frozen=True)
class SizingSettings:
    """The search for a size; chosen by trial on development sets.

    max_draws: draws of effects on one arm; the last one is kept although it cannot be seen. min_target_share: share
    of the target multiple that counts as seen. max_steps, tolerance: of the search on reference tracks, the tolerance
    as logarithm of the multiple. min_multiple, max_factor: smallest multiple that is divided by, and longest step of
    the size. exponents: range of the power of the size that a multiple may follow. max_coarse_passes,
    coarse_tolerance: of the search on coarse simulations. max_halvings: shorter steps where a simulation runs away.
    """

    max_draws: int = 6
    min_target_share: float = 0.6
    max_steps: int = 4
    tolerance: float = 0.03
    min_multiple: float = 1e-9
    max_factor: float = 1e3
    exponents: tuple[float, float] = (0.25, 3.0)
    max_coarse_passes: int = 6
    coarse_tolerance: float = 0.1
    max_halvings: int = 3


ORACLE, SIZING = OracleSettings(), SizingSettings()


def candidate_count(joints: int) -> int:
    """Number of tests that a diagnosis makes, effects times places: the level of a test is corrected for it."""
    places = {"joint": joints, "coupling": joints * (joints - 1), "link": joints, "robot": 1}
    return sum(places[effect.where] for effect in LIBRARY)


@lru_cache(maxsize=32)
def limit_noncentrality(joints: int) -> float:
    """Noncentrality of a chi-square of one degree of freedom that is found with 90 % power."""
    return float(brentq(lambda value: detection_power(value, joints) - ORACLE.power, 1.0, 200.0))


def detection_power(noncentrality: float, joints: int) -> float:
    """Chance to find an effect, at the level of the oracle."""
    return float(ncx2.sf(chi2.isf(ORACLE.family_wise_level / candidate_count(joints), 1), 1, noncentrality))


@dataclass(frozen=True, eq=False)
class Oracle:
    """Whitens rows by the true noise and projects out what is free.

    noise: of the rows. resting: of each run, (samples, joints), where a joint stands still; empty where none does.
    encoder_filters: whiten the rows of each run that has noise of positions, see `whitening_filter`; empty for an
    oracle that knows the motion. Such noise is common to the joints, so that the bridge over a joint at rest reaches
    rows of others, a little.
    basis: (rows, columns), orthonormal, of the free columns.
    """

    noise: Noise
    resting: tuple[NDArray[np.bool_], ...] = ()
    encoder_filters: tuple[Array, ...] = ()
    basis: Array | None = None

    def with_free_columns(self, columns: Sequence[Array]) -> "Oracle":
        """The oracle with free columns, a (samples, joints, columns) each run."""
        return replace(self, basis=_orthonormal_basis(self._rows(columns)))

    def multiple(self, torque: Sequence[Array], beside: Sequence[Array] | None = None) -> float:
        """How many detection limits an effect is large whose torque is (samples, joints) in each run.

        beside: columns that are free for this effect alone, (samples, joints, columns) each run.
        """
        left = self.rows_without_free(torque, beside)
        return float(np.sqrt(left @ left / limit_noncentrality(torque[0].shape[1])))

    def rows_without_free(self, torque: Sequence[Array], beside: Sequence[Array] | None = None) -> Array:
        """Whitened rows (rows,) of a torque, (samples, joints) each run, without what free columns explain."""
        rows = self._rows([run[..., None] for run in torque])
        parts = [] if self.basis is None else [self.basis]
        if beside is not None:
            parts.append(_orthonormal_basis(_project_out(self._rows(beside), parts)))
        return np.asarray(_project_out(rows, parts)[:, 0])

    def _rows(self, columns: Sequence[Array]) -> Array:
        """Whitened rows (rows, columns) of all runs, (samples, joints, columns) each."""
        resting = self.resting or tuple(np.zeros(run.shape[:2], dtype=bool) for run in columns)
        out = []
        for number, (run, rest) in enumerate(zip(columns, resting, strict=True)):
            bridged = [_bridged(run[:, joint], rest[:, joint]) for joint in range(run.shape[1])]
            if self.encoder_filters:
                whole = whiten_with_encoders(np.stack(bridged, 1), self.encoder_filters[number])
                white = list(whole.transpose(1, 0, 2))
            else:
                white = [self.noise.whitened(each, joint, ORACLE.rate_hz) for joint, each in enumerate(bridged)]
            out += [np.where(rest[:, joint, None], 0.0, each) for joint, each in enumerate(white)]
        return np.vstack(out)


def _bridged(columns: Array, gaps: NDArray[np.bool_]) -> Array:
    """Columns (samples, columns) with straight lines over gaps (samples,)."""
    if not gaps.any():
        return columns
    place, known = np.arange(len(columns)), np.flatnonzero(~gaps)
    lines = [np.interp(place, known, column[known]) for column in columns.T] if len(known) else columns.T * 0
    return np.column_stack(list(lines))


def _project_out(rows: Array, bases: Sequence[Array]) -> Array:
    for _ in range(2):
        for basis in bases:
            rows = rows - basis @ (basis.T @ rows)
    return rows


def _orthonormal_basis(columns: Array) -> Array:
    """An orthonormal basis of columns, dependent ones left out."""
    lengths = np.linalg.norm(columns, axis=0)
    scaled = columns[:, lengths > 0] / lengths[lengths > 0]
    power, axes = np.linalg.eigh(scaled.T @ scaled)
    kept = power > ORACLE.min_column_power
    return np.asarray(scaled @ (axes[:, kept] / np.sqrt(power[kept])))


@dataclass(frozen=True, eq=False)
class SizedEffects:
    """Effects with their sizes. targets: wanted multiples. passed_over: effects that were drawn and not seen."""

    hidden: tuple[HiddenEffect, ...]
    targets: tuple[float, ...]
    passed_over: tuple[str, ...] = ()

    def with_size(self, number: int, size: float) -> "SizedEffects":
        """The same with another size of one effect."""
        changed = self.hidden[number].sized(size)
        return replace(self, hidden=(*self.hidden[:number], changed, *self.hidden[number + 1 :]))


def draw_sized_effects(plan: Plan, tracks: Sequence[Track]) -> SizedEffects:
    """Effects of the wanted sizes on the reference tracks; effects that cannot be seen there are drawn again.

    The last draw is always kept.
    """
    oracle, passed_over = make_oracle(plan, tracks), list[str]()
    motors = [track.load + law_torque(plan.background, track, 0) for track in identification_tracks(plan, tracks)]
    peak = np.max([np.abs(torque).max(axis=0) for torque in motors], axis=0)
    for attempt in range(SIZING.max_draws):
        hidden = tuple(effect.with_peak_torque(peak) for effect in draw_effects(plan, attempt))
        targets = tuple(target_multiple(plan, number) for number in range(len(hidden)))
        sized, seen = SizedEffects(hidden, targets, tuple(passed_over)), True
        for number, target in enumerate(targets):
            sized, found = _scale_to_multiple(plan, oracle, sized, number, tracks, target)
            seen = seen and found > SIZING.min_target_share * target
        if seen:
            break
        passed_over += [effect.effect for effect in hidden]
    return sized


def resize_effects(plan: Plan, sized: SizedEffects, tracks: Sequence[Track]) -> SizedEffects:
    """Sizes corrected on simulated tracks. An effect with parts of its own keeps its size."""
    oracle = make_oracle(plan, tracks)
    for number, target in enumerate(sized.targets):
        sized, _ = _scale_to_multiple(plan, oracle, sized, number, tracks, target)
    return sized


def next_size(tried: Sequence[tuple[float, float]], target: float) -> float:
    """The size where a power law through the last two tries (size, multiple) has the target; a line after one try."""
    size, found = tried[-1]
    power = 1.0
    if len(tried) > 1 and tried[-2][0] != size:
        before, then = tried[-2]
        power = float(np.clip(np.log(found / then) / np.log(size / before), *SIZING.exponents))
    return float(size * np.clip((target / found) ** (1 / power), 1 / SIZING.max_factor, SIZING.max_factor))


def effect_multiples(plan: Plan, hidden: Sequence[HiddenEffect], tracks: Sequence[Track]) -> tuple[float, ...]:
    """Detection limits of each effect on the tracks of all runs."""
    oracle = make_oracle(plan, tracks)
    return tuple(effect_multiple(plan, oracle, hidden, number, tracks) for number in range(len(hidden)))


def make_oracle(
    plan: Plan, tracks: Sequence[Track], encoders: Sequence[EncoderNoise] = (), away_s: float | None = None
) -> Oracle:
    """Knows the noise; in the realistic tier base parameters and friction of every joint are free.

    encoders: noise of the positions of each run that identifies; without them the oracle knows the motion. away_s: the
    rows of a joint that are nearer to one of its reversals count nothing; None leaves only standstills out.
    """
    runs, noise = identification_tracks(plan, tracks), row_noise(plan)
    resting = tuple(standstills(track, oracle_grid(track)) for track in runs)
    if away_s is not None:
        resting = tuple(
            still | near_reversals(track, oracle_grid(track), away_s)
            for still, track in zip(resting, runs, strict=True)
        )
    filters = (
        whitening_filter(len(still), noise, each, ORACLE.rate_hz)
        for still, each in zip(resting, encoders, strict=False)  # none where the motion is known
    )
    oracle = Oracle(noise, resting, tuple(filters))
    if not plan.realistic:
        return oracle
    return oracle.with_free_columns([free_columns(plan.true_arm, track, oracle_grid(track)) for track in runs])


def row_noise(plan: Plan) -> Noise:
    """Noise of the rows of a detection limit, each a mean over several samples of a recording."""
    share = min(ORACLE.rate_hz / plan.rate_hz, 1.0)
    return replace(plan.noise, white=plan.noise.white * np.sqrt(share))


def standstills(track: Track, grid: Array) -> NDArray[np.bool_]:
    """Rows (samples, joints) at the instants of a grid, s, in which a joint stands still, or in one beside them."""
    still = np.vstack([np.zeros(track.joints), np.cumsum(track.velocity == 0, axis=0)])
    reach = 1.5 * (grid[1] - grid[0])
    first, last = (np.searchsorted(track.time, grid + side * reach) for side in (-1, 1))
    return np.asarray(still[last] > still[first])


def near_reversals(track: Track, grid: Array, reach_s: float) -> NDArray[np.bool_]:
    """Rows (samples, joints) at the instants of a grid, s, that are within a time of a reversal of the joint."""
    turns = np.diff(np.sign(track.velocity), axis=0) != 0
    count = np.vstack([np.zeros((2, track.joints)), np.cumsum(turns, axis=0)])
    first, last = (np.searchsorted(track.time, grid + side * reach_s) for side in (-1, 1))
    return np.asarray(count[last] > count[first])


def effect_multiple(
    plan: Plan, oracle: Oracle, hidden: Sequence[HiddenEffect], number: int, tracks: Sequence[Track]
) -> float:
    """Detection limits of one effect among others; in the clean tier its own plain friction is free beside it."""
    effect, rest = hidden[number], (*hidden[:number], *hidden[number + 1 :])
    arms, runs = (arm_with_effects(plan, hidden), arm_with_effects(plan, rest)), identification_tracks(plan, tracks)
    others = (*plan.background, *rest)
    shares = [
        effect_torque(effect, arms, RunWithout(track, others, run, oracle_grid(track)))
        for run, track in enumerate(runs)
    ]
    return oracle.multiple(shares, companion_columns(plan, effect, runs))


def companion_columns(plan: Plan, effect: HiddenEffect, runs: Sequence[Track]) -> list[Array] | None:
    """Columns of plain friction that is free beside an effect of the clean tier, (samples, joints, columns) a run."""
    if plan.realistic or not effect.companions:
        return None
    columns = [free_columns(plan.true_arm, track, oracle_grid(track), friction_only=True) for track in runs]
    chosen = [effect.joint + len(plan.true_arm) * ("coulomb", "viscous").index(name) for name in effect.companions]
    return [each[..., chosen] for each in columns]


def _scale_to_multiple(
    plan: Plan, oracle: Oracle, sized: SizedEffects, number: int, tracks: Sequence[Track], target: float
) -> tuple[SizedEffects, float]:
    """One effect scaled to a multiple, and the multiple reached. An effect with parts of its own keeps its size."""
    if sized.hidden[number].has_parts:
        return sized, target
    found = effect_multiple(plan, oracle, sized.hidden, number, tracks)
    for _ in range(SIZING.max_steps):
        factor = float(np.clip(target / max(found, SIZING.min_multiple), 1 / SIZING.max_factor, SIZING.max_factor))
        if abs(np.log(factor)) < SIZING.tolerance:
            break
        sized = sized.with_size(number, sized.hidden[number].size * factor)
        found = effect_multiple(plan, oracle, sized.hidden, number, tracks)
    return sized, found


def identification_tracks(plan: Plan, tracks: Sequence[Track]) -> list[Track]:
    """The tracks from which a diagnosis may learn."""
    return [track for track, run in zip(tracks, plan.runs, strict=True) if run.role == "identify"]


def oracle_grid(track: Track) -> Array:
    """Instants of the rows of the oracle, s."""
    return np.asarray(np.arange(0.0, track.time[-1] - ORACLE.end_s, 1 / ORACLE.rate_hz))


@dataclass(frozen=True, eq=False)
class SimulatedCase:
    """The runs of a case before any channel recorded them. multiples: size of each effect in detection limits."""

    plan: Plan
    sized: SizedEffects
    tracks: tuple[Track, ...]
    multiples: tuple[float, ...]

    @property
    def hidden(self) -> tuple[HiddenEffect, ...]:
        """The hidden effects with their final sizes."""
        return self.sized.hidden

    @property
    def all_effects(self) -> tuple[HiddenEffect, ...]:
        """Background and hidden effects."""
        return (*self.plan.background, *self.hidden)


def simulate_case(plan: Plan, given: tuple[HiddenEffect, ...] | None = None) -> SimulatedCase:
    """Simulates a case, with the effects that its plan draws or with given ones of given sizes."""
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    wanted = [reference_track(plan, number, run) for number, run in enumerate(plan.runs)]
    sized = draw_sized_effects(plan, wanted) if given is None else SizedEffects(given, tuple(0.0 for _ in given))
    coarse = simulate_runs(plan, sized.hidden, controller, wanted, [coarse_track(track) for track in wanted])
    if given is None:
        sized, coarse = correct_sizes(plan, sized, controller, wanted, coarse)
    fine = simulate_runs(plan, sized.hidden, controller, coarse, wanted)
    return SimulatedCase(plan, sized, fine, effect_multiples(plan, sized.hidden, fine))


def correct_sizes(
    plan: Plan, sized: SizedEffects, controller: Controller, wanted: Sequence[Track], coarse: tuple[Track, ...]
) -> tuple[SizedEffects, tuple[Track, ...]]:
    """Sizes with the wanted multiples on coarse tracks, and the last of these tracks.

    coarse: tracks simulated with the sizes so far.
    """
    number = next((number for number, effect in enumerate(sized.hidden) if effect.has_parts), None)
    if number is not None:
        sized, coarse = _search_size(plan, sized, number, controller, wanted, coarse)
    return resize_effects(plan, sized, coarse), coarse


def _search_size(
    plan: Plan,
    sized: SizedEffects,
    number: int,
    controller: Controller,
    wanted: Sequence[Track],
    coarse: tuple[Track, ...],
) -> tuple[SizedEffects, tuple[Track, ...]]:
    """The effect with parts at the size whose multiple comes nearest to the target, and its tracks."""
    target, tried = sized.targets[number], list[tuple[float, float]]()
    best = (np.inf, sized, coarse)
    for more in reversed(range(SIZING.max_coarse_passes)):
        found = max(effect_multiple(plan, make_oracle(plan, coarse), sized.hidden, number, coarse), SIZING.min_multiple)
        tried.append((sized.hidden[number].size, found))
        best = min(best, (abs(float(np.log(found / target))), sized, coarse), key=lambda each: each[0])
        aimed = sized.with_size(number, next_size(tried, target))
        if not more or best[0] < SIZING.coarse_tolerance or aimed.hidden[number].size == tried[-1][0]:
            break
        played = _simulate_toward_size(plan, sized, aimed, number, controller, wanted)
        if played is None:
            break
        sized, coarse = played
    return best[1], best[2]


def _simulate_toward_size(
    plan: Plan, sized: SizedEffects, aimed: SizedEffects, number: int, controller: Controller, wanted: Sequence[Track]
) -> tuple[SizedEffects, tuple[Track, ...]] | None:
    """Coarse tracks at the wanted size, or at a size between where the simulation runs away; None if all run away."""
    for _ in range(SIZING.max_halvings):
        try:
            return aimed, simulate_runs(
                plan, aimed.hidden, controller, wanted, [coarse_track(track) for track in wanted]
            )
        except FloatingPointError:
            middle = float(np.sqrt(sized.hidden[number].size * aimed.hidden[number].size))
            aimed = aimed.with_size(number, middle)
    return None
