"""Random cases of a real recording: what is concealed, where and how strong, from a seed and the identification runs.

The strength of a case is RMS(concealed torque) / RMS(error of the reference model) on the identification runs, at the
joint where this ratio is largest. Both torques pass the filter of the reference. Most disturbances are linear in their
size, so that one division gives the size that has the target strength; delays are sought by secant steps in logarithms.
"""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import get_args

import numpy as np

from armlab.common.arrays import Array
from armlab.common.streams import named_generator
from armlab.effects.contract import UNITS
from armlab.proof.open.real_concealed.conceal import (
    LATE_KINDS,
    LAWS_BY_KIND,
    ReferenceModel,
    add_disturbance,
    withhold_pieces,
)
from armlab.proof.open.real_concealed.concealed_case import Case, Disturbance, DisturbanceKind, Piece, PieceKind
from armlab.proof.open.real_identification.identify_recording import recipe_named
from armlab.recordings.differentiate import Signals
from problem.arm import Arm

STRENGTHS = (0.3, 8.0)  # targets, log-uniform
INJECTED_KINDS: tuple[DisturbanceKind, ...] = get_args(DisturbanceKind)
WITHHELD_KINDS = tuple(Piece(kind) for kind in get_args(PieceKind))
UNIT_FORMS = {
    "payload": "kg",
    "cable_stiffness": "{torque}/{position}",
    "time_delay": "s",
    "channel_skew": "s",
    "viscous_friction": "{torque}.s/{position}",
    "torque_gain_error": "1",
    "rotor_inertia": "{inertia}",
}  # of a size; a torque where none is stated
SIGNED_KINDS = ("torque_gain_error", "torque_offset")
LARGEST_SIZES = {"time_delay": 0.1, "channel_skew": 0.1, "torque_gain_error": 0.5}  # s, s, share: more is no recording
SIZE_DIGITS = 3  # the last digits of a reference model differ from run to run, those of a case must not
FIRST_DELAY_S, MAX_DELAY_STEPS, DELAY_TOLERANCE = 0.002, 8, 0.01  # tolerance: of the strength, a share

RIPPLE_ORDERS = {"revolute": range(10, 61), "prismatic": range(100, 601)}  # cycles a turn; rad/m
MIN_RIPPLE_CYCLES = 2.0  # in the range of a joint
LEAST_TRAVEL = {"revolute": 0.05, "prismatic": 0.005}  # rad, m: a joint that moves less shows little
TURN_OVER_SHARE = 0.01  # of the highest speed: where Coulomb friction turns over


@dataclass(frozen=True)
class DrawnCase:
    """A case, and its strength."""

    case: Case
    strength: float


@dataclass(frozen=True, eq=False)
class StrengthGauge:
    """A reference model on its identification runs. error: RMS of each joint, (joints,), N m (N)."""

    reference: ReferenceModel
    signals: tuple[Signals, ...]
    error: Array

    @property
    def arm(self) -> Arm:
        """The arm."""
        return self.reference.recording.arm

    @property
    def position(self) -> Array:
        """Of all runs, (samples, joints), rad (m)."""
        return np.concatenate([each.motion.position for each in self.signals])

    @property
    def speed(self) -> Array:
        """The highest of each joint, (joints,), rad/s (m/s)."""
        return np.asarray(np.max([np.abs(each.motion.velocity).max(axis=0) for each in self.signals], axis=0))

    def strength(self, case: Case) -> float:
        """Of a case with something concealed."""
        model = self.reference.model
        if case.injected is not None:
            torques = [self._added_torque(each, case.injected) for each in self.signals]
        else:
            handed = withhold_pieces(model, case.withheld)
            torques = [model.filtered_torque(each) - handed.filtered_torque(each) for each in self.signals]
        return float(np.max(_rms(torques) / self.error))

    def _added_torque(self, signals: Signals, what: Disturbance) -> Array:
        """Filtered torque of a disturbance, (kept, joints); a late run is shorter and has its own filter."""
        changed, added = add_disturbance(signals.run, self.arm, what)
        own = self.reference.model.signals(changed) if what.effect in LATE_KINDS else signals
        return np.asarray(own.filter(added))


def make_gauge(reference: ReferenceModel) -> StrengthGauge:
    """What measures the strength of the cases of a reference."""
    model = reference.model
    signals = tuple(model.signals(run) for run in reference.recording.with_role("identify"))
    return StrengthGauge(reference, signals, _rms([each.torque - model.filtered_torque(each) for each in signals]))


def _rms(torques: Sequence[Array]) -> Array:
    return np.asarray(np.sqrt(np.mean(np.concatenate(torques) ** 2, axis=0)))


def draw_cases(reference: ReferenceModel, seed: int, number: int) -> tuple[DrawnCase, ...]:
    """The first random cases of a recording.

    Each kind that makes sense for the arm comes once before any comes twice; a part of the reference is withheld once
    at most. The first cases are the same however many are drawn.
    """
    name, gauge = reference.recording.name, make_gauge(reference)
    kinds, drawn, turn = (*INJECTED_KINDS, *WITHHELD_KINDS), list[DrawnCase](), 0
    while len(drawn) < number:
        order = named_generator("real-concealed", "order", name, seed, turn).permutation(len(kinds))
        for kind in (kinds[place] for place in order):
            rng = named_generator("real-concealed", "case", name, seed, turn, repr(kind))
            if isinstance(kind, Piece):
                case = _draw_piece(rng, reference, kind, {each.case for each in drawn})
            else:
                case = _draw_disturbance(rng, gauge, kind)
            if case is not None and len(drawn) < number:
                drawn.append(DrawnCase(case, gauge.strength(case)))
        turn += 1
    return tuple(drawn)


def _draw_piece(
    rng: np.random.Generator, reference: ReferenceModel, kind: Piece, used: Collection[Case]
) -> Case | None:
    """One part of the reference that is still there in all cases; None without any.

    Friction and a counterbalance are those of one joint. A load is known where the recipe of the recording has one.
    """
    recording = reference.recording
    joints: set[int | None] = {
        part.joint for part in reference.model.structure.components if part.effect in LAWS_BY_KIND[kind.kind]
    }
    if kind.kind == "wrist coupling" and joints:
        joints = {None}
    if kind.kind == "payload" and recipe_named(recording.name).payload is not None:
        joints = {len(recording.arm)}
    cases = [
        Case(recording.name, (replace(kind, joint=joint),)) for joint in sorted(joints, key=lambda each: each or 0)
    ]
    left = [each for each in cases if each not in used]
    return left[rng.integers(len(left))] if left else None


def _draw_disturbance(rng: np.random.Generator, gauge: StrengthGauge, kind: DisturbanceKind) -> Case | None:
    """A disturbance with the target strength, or the strongest sensible one; None where no joint can show it."""
    name, start = gauge.reference.recording.name, _draw_shape(rng, gauge, kind)
    low, high = STRENGTHS
    target = low * (high / low) ** rng.random()
    sign = float(rng.choice([-1.0, 1.0])) if kind in SIGNED_KINDS else 1.0
    if start is None:
        return None

    def strength(size: float) -> float:
        return gauge.strength(Case(name, (), replace(start, size=size)))

    size = delay_of_strength(strength, target) if kind in LATE_KINDS else target / strength(1.0)
    size = sign * min(size, LARGEST_SIZES.get(kind, np.inf))
    return Case(name, (), replace(start, size=float(f"{size:.{SIZE_DIGITS}g}")))


def _draw_shape(rng: np.random.Generator, gauge: StrengthGauge, kind: DisturbanceKind) -> Disturbance | None:
    """A disturbance of size 1 at a random joint; None where no joint can show it."""
    arm, position = gauge.arm, gauge.position
    travel = np.ptp(position, axis=0)
    places = [index for index, joint in enumerate(arm.joints) if travel[index] > LEAST_TRAVEL[joint.kind]]
    orders = {index: _visible_orders(gauge, index, float(travel[index])) for index in places}
    if kind == "torque_ripple":
        places = [index for index in places if orders[index]]
    if kind == "payload":
        places = _payload_places(len(arm))
    if not places:
        return None
    index = int(rng.choice(places))
    units = UNITS[arm.joints[index].kind]
    start = Disturbance(kind, index + 1, 1.0, UNIT_FORMS.get(kind, "{torque}").format(**units).replace(".", " "))
    match kind:
        case "time_delay":
            return replace(start, joint=None)
        case "payload":
            return _with_body(rng, start, sliding=arm.joints[index].kind == "prismatic")
        case "cable_stiffness":
            low, high = np.quantile(position[:, index], [0.05, 0.95])
            return replace(start, rest=float(rng.uniform(low, high)))
        case "coulomb_friction":
            return replace(start, width=TURN_OVER_SHARE * float(gauge.speed[index]))
        case "torque_ripple":
            return replace(start, order=int(rng.choice(orders[index])), phase=float(rng.uniform(-np.pi, np.pi)))
        case _:
            return start


def _payload_places(joints: int) -> list[int]:
    """The last link, three times as often as each of the two before it; the first one only if it is the last."""
    last = joints - 1
    return [last, last, last, *(link for link in (last - 1, last - 2) if link > 0)]


def _with_body(rng: np.random.Generator, start: Disturbance, sliding: bool) -> Disturbance:
    """A ball somewhere beside the link's frame; on a joint that slides only its mass matters."""
    if sliding:
        return replace(start, radius=0.0)
    x, y, z = rng.uniform((-0.08, -0.08, 0.0), (0.08, 0.08, 0.15)).tolist()
    return replace(start, centre=(x, y, z), radius=float(rng.uniform(0.03, 0.08)))


def _visible_orders(gauge: StrengthGauge, index: int, travel: float) -> list[int]:
    """Orders of a ripple that the range of a joint holds some cycles of, and that the filter lets pass."""
    cutoff = min(each.position_cutoff_hz or np.inf for each in gauge.signals)
    limit = gauge.reference.model.cutoff_hz or cutoff
    orders = RIPPLE_ORDERS[gauge.arm.joints[index].kind]
    lowest, highest = 2 * np.pi * MIN_RIPPLE_CYCLES / travel, 2 * np.pi * min(cutoff, limit) / gauge.speed[index]
    return [order for order in orders if lowest <= order <= highest]


def delay_of_strength(strength: Callable[[float], float], target: float) -> float:
    """The delay, s, that has a strength, by secant steps in logarithms; the longest one where all have less.

    log strength = a + b log delay through the last two delays; b is near 1 for short ones, and 0 where the torque has
    come round.
    """
    longest = LARGEST_SIZES["time_delay"]
    delays, logs = [FIRST_DELAY_S], [np.log(strength(FIRST_DELAY_S))]
    slope = 1.0
    for _ in range(MAX_DELAY_STEPS):
        if abs(logs[-1] - np.log(target)) < DELAY_TOLERANCE:
            break
        wanted = np.log(delays[-1]) + (np.log(target) - logs[-1]) / slope
        delays.append(float(np.exp(min(wanted, np.log(longest)))))
        logs.append(np.log(strength(delays[-1])))
        if delays[-1] == delays[-2]:
            break
        found = (logs[-1] - logs[-2]) / np.log(delays[-1] / delays[-2])
        slope = float(np.clip(found, 0.3, 3.0))
    return delays[int(np.argmin(np.abs(np.array(logs) - np.log(target))))]
