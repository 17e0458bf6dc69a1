"""How far could anyone get? An oracle that knows all laws, of the library and outside it, and names hidden effects.

The oracle of detection limits knows the motion and the law, and asks whether it is there. This one has positions as
they are recorded (`encoder_noise.py`), knows the noise and every law, and asks which it is. With s the
torque of a hidden effect and u that of another law, both whitened and without what free columns explain, the other law
of the size that fits best leaves

    d^2 = |s|^2 - (s . u)^2 / |u|^2

of the effect. Twice the expected difference of log likelihoods is d^2, its standard deviation d, so that the oracle
prefers the right law with the probability Phi(d / 2), Phi the normal distribution. With its rivals ordered by d, it has
the right name with the probability that it sees the effect and prefers it to all of them, and the right class of four
where it prefers it to all but three; the comparisons are taken as independent.

The numbers of another law are sought: many draws as a set has them, then steps about the best. A law of a link may be
any sum of draws, because its parameters are linear. Laws with parts of their own act on motions of their own.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.proof.blind.case_files import encoder_steps
from armlab.proof.blind.effects.friction import EarlyFriction
from armlab.proof.blind.effects.hidden import HiddenEffect
from armlab.proof.blind.effects.library import LIBRARY
from armlab.proof.blind.encoder_noise import encoder_noise
from armlab.proof.blind.engine import Track
from armlab.proof.blind.outside import OUTSIDE
from armlab.proof.blind.plan import Plan
from armlab.proof.blind.score.cases import CONTAINED_EFFECTS, is_indistinguishable
from armlab.proof.blind.simulate import (
    Controller,
    RunWithout,
    absorbed_rotors,
    arm_with_effects,
    coarse_track,
    draw_controller,
    effect_torque,
    reference_track,
    simulate_runs,
)
from armlab.proof.blind.sizing import (
    Oracle,
    SimulatedCase,
    companion_columns,
    detection_power,
    identification_tracks,
    limit_noncentrality,
    make_oracle,
    oracle_grid,
)

LAWS: tuple[type[HiddenEffect], ...] = (*LIBRARY, *OUTSIDE, EarlyFriction)
AWAY_S = 0.025  # a period of 40 Hz: what is nearer to a reversal counts as at the reversal
LOOKS, LINK_DRAWS = 3, 12  # draws at every place, and where the sum of draws counts
SOUGHT, DRAWS, STEPS, ROUNDS = 6, 12, 8, 2  # laws that are sought further, by draws and by rounds of steps
STEP_SHARE = 0.3  # of a number, standard deviation of a step about the best draw
HELD_NUMBERS = ("from", "direction", "run")  # of a law's shape, which are no quantities
CLASS_SIZE = 4
LIMITS = {  # what a law is at an end of the range of its numbers, beside what it holds as a part
    "friction_curve": ("nonlinear_viscous_friction", "stribeck_friction"),
    "nonlinear_viscous_friction": ("viscous_friction", "coulomb_friction"),
    "asymmetric_friction": ("nonlinear_viscous_friction",),
}


@dataclass(frozen=True)
class OracleAnswer:
    """What the oracle says of one hidden effect. multiple: its size in detection limits.

    multiple_recorded: the same of an oracle that has recorded positions; multiple_away: of one that has nothing within
    25 ms of a reversal of each joint. seen: the probability that the one with recorded positions finds it.
    rival: the law that is hardest to tell from it, at its place (from 1, None for the whole arm), and distance: d.
    right_name, right_class: probabilities.
    """

    case: str
    tier: str
    effect: str
    form: str
    joint: int | None
    outside: bool
    multiple: float
    multiple_recorded: float
    multiple_away: float
    seen: float
    rival: str
    rival_joint: int | None
    distance: float
    right_name: float
    right_class: float


@dataclass(frozen=True, eq=False)
class _Laboratory:
    """Where laws are compared: coarse runs of a case, and rows without what is free.

    others: effects beside the one that is asked. motion_known, oracle: know the motion, or have recorded positions;
    away: has recorded positions away from reversals.
    beside: plain friction that is free for it, (samples, joints, columns) a run, or None. absorbed_rotors: joints (from
    1) whose rotor no motion separates from the links.
    """

    plan: Plan
    controller: Controller
    wanted: Sequence[Track]
    runs: Sequence[RunWithout]
    others: tuple[HiddenEffect, ...]
    motion_known: Oracle
    oracle: Oracle
    away: Oracle
    beside: Sequence[Array] | None
    absorbed_rotors: tuple[int, ...]

    def rows(self, effect: HiddenEffect) -> Array:
        """Whitened rows of an effect of any law, free columns projected out."""
        return self.oracle.rows_without_free(self.torque(effect), self.beside)

    def torque(self, effect: HiddenEffect) -> list[Array]:
        """What an effect of any law adds to the recorded torque, (samples, joints) each run, N m."""
        hidden = tuple(each for each in self.others if each not in self.plan.background)
        runs = self.runs
        if effect.has_parts:
            plan = replace(self.plan, engine="mujoco")  # which alone has parts
            played = simulate_runs(plan, (*hidden, effect), self.controller, self.wanted, self.wanted)
            tracks = identification_tracks(plan, played)
            runs = [replace(run, track=track) for run, track in zip(runs, tracks, strict=True)]
        arms = arm_with_effects(self.plan, (*hidden, effect)), arm_with_effects(self.plan, hidden)
        return [effect_torque(effect, arms, run) for run in runs]


def ask_oracle(case: SimulatedCase, least: float) -> Iterator[OracleAnswer]:
    """What the oracle says of each hidden effect of a case. least: detection limits; smaller effects are left out."""
    for number, multiple in enumerate(case.multiples):
        if multiple > least:
            yield _ask(case, number)


def _ask(case: SimulatedCase, number: int) -> OracleAnswer:
    effect, plan = case.hidden[number], case.plan
    laboratory = _make_laboratory(case, number)
    joints, torque = plan.machine.joints, laboratory.torque(effect)
    coarse = max(laboratory.motion_known.multiple(torque, laboratory.beside), 1e-150)
    scale = case.multiples[number] / coarse  # from the coarse simulation to the recording
    own = laboratory.oracle.rows_without_free(torque, laboratory.beside) * scale
    power = float(own @ own)
    seen = detection_power(power, joints)
    rng = plan.stream(f"oracle {number}")
    rivals = sorted(_distances(laboratory, effect, own, rng), key=lambda each: each[0])
    better = [float(norm.cdf(each[0] / 2)) for each in rivals]
    distance, law, place = rivals[0]
    return OracleAnswer(
        case=plan.name,
        tier=plan.tier,
        effect=effect.effect,
        form=effect.form,
        joint=effect.place,
        outside=effect.is_outside,
        multiple=case.multiples[number],
        multiple_recorded=float(np.sqrt(power / limit_noncentrality(joints))),
        multiple_away=laboratory.away.multiple(torque, laboratory.beside) * scale,
        seen=seen,
        rival=law,
        rival_joint=place,
        distance=distance,
        right_name=seen * float(np.prod(better)),
        right_class=seen * float(np.prod(better[CLASS_SIZE - 1 :])),
    )


def _make_laboratory(case: SimulatedCase, number: int) -> _Laboratory:
    plan, effect = case.plan, case.hidden[number]
    wanted = [coarse_track(reference_track(plan, at, run)) for at, run in enumerate(plan.runs)]
    tracks = [coarse_track(track) for track in case.tracks]
    others = tuple(each for each in case.all_effects if each is not effect)
    controller = draw_controller(plan.stream("controller"), plan.machine.arm)
    chosen, runs = identification_tracks(plan, tracks), (n for n, run in enumerate(plan.runs) if run.role == "identify")
    encoders = [
        encoder_noise(plan.true_arm, track, encoder_steps(plan, run), plan.rate_hz)
        for run, track in zip(runs, chosen, strict=True)
    ]
    absorbed = tuple(joint + 1 for joint in absorbed_rotors(plan.machine.arm))
    return _Laboratory(
        plan=plan,
        controller=controller,
        wanted=wanted,
        runs=[RunWithout(track, others, run, oracle_grid(track)) for run, track in enumerate(chosen)],
        others=others,
        motion_known=make_oracle(plan, tracks),
        oracle=make_oracle(plan, tracks, encoders),
        away=make_oracle(plan, tracks, encoders, AWAY_S),
        beside=companion_columns(plan, effect, chosen),
        absorbed_rotors=absorbed,
    )


def _distances(
    laboratory: _Laboratory, effect: HiddenEffect, own: Array, rng: np.random.Generator
) -> Iterator[tuple[float, str, int | None]]:
    """The distance of each other law at each place, with its name and place."""
    machine = laboratory.plan.machine
    peak = np.max([np.abs(run.motor).max(axis=0) for run in laboratory.runs], axis=0)
    places = [(kind, int(joint)) for kind in LAWS for joint in kind.places(machine)]
    looked = [each for each in (_first_look(laboratory, effect, own, place, peak, rng) for place in places) if each]
    looked.sort(key=lambda each: each[0])
    for left, kind, first in looked[:SOUGHT]:
        if kind.where != "link" and not first.has_parts:
            draws = [first, *_draws(kind, first.joint, laboratory, peak, rng, DRAWS)]
            left = min(left, _left_by_best(laboratory, own, draws, rng))
        yield float(np.sqrt(max(left, 0.0))), first.effect, first.place
    for left, _, first in looked[SOUGHT:]:
        yield float(np.sqrt(max(left, 0.0))), first.effect, first.place


def _first_look(
    laboratory: _Laboratory,
    effect: HiddenEffect,
    own: Array,
    place: tuple[type[HiddenEffect], int],
    peak: Array,
    rng: np.random.Generator,
) -> tuple[float, type[HiddenEffect], HiddenEffect] | None:
    """What a law at a place leaves by a few draws, and the best of them; None for what has the right name.

    Nor is there a rival where every draw runs away in the coarse simulation.
    """
    kind, joint = place
    first, *more = _draws(kind, joint, laboratory, peak, rng, LINK_DRAWS if kind.where == "link" else LOOKS)
    if _is_right(first, effect, laboratory):
        return None
    if kind.where == "link":
        return _left_by_all(own, [laboratory.rows(each) for each in (first, *more)]), kind, first
    if first.has_parts:
        return _look_at_parts(own, laboratory, (first, *more))
    left = [_left_by(own, laboratory, each) for each in (first, *more)]
    return min(left), kind, (first, *more)[int(np.argmin(left))]


def _look_at_parts(
    own: Array, laboratory: _Laboratory, draws: Sequence[HiddenEffect]
) -> tuple[float, type[HiddenEffect], HiddenEffect] | None:
    """What the first draw leaves that does not run away in the coarse simulation; None where all do."""
    for each in draws:
        try:
            return _left_by(own, laboratory, each), type(each), each
        except FloatingPointError:
            continue
    return None


def _draws(
    kind: type[HiddenEffect], joint: int, laboratory: _Laboratory, peak: Array, rng: np.random.Generator, count: int
) -> list[HiddenEffect]:
    return [kind.draw(rng, laboratory.plan.machine, joint).with_peak_torque(peak) for _ in range(count)]


def _is_right(other: HiddenEffect, effect: HiddenEffect, laboratory: _Laboratory) -> bool:
    """Whether another law has the right name, or one that the score counts as right, or holds the right one.

    A law that holds the right one as a limit fits as well, and has more numbers: the simpler one is preferred. Of an
    effect outside the library, the right answer is that it is there: any other law outside says so, too.
    """
    if effect.is_outside:
        return other.is_outside
    if other.place == effect.place and (
        other.effect in (effect.effect, *effect.equivalent) or _holds(type(other), type(effect))
    ):
        return True
    names = other.effect, other.place, effect.effect, effect.place
    return is_indistinguishable(*names, laboratory.plan.machine.joints, laboratory.absorbed_rotors)


def _holds(other: type[HiddenEffect], effect: type[HiddenEffect]) -> bool:
    """Whether the law of an effect is a limit of that of another one."""
    return effect.effect in (*CONTAINED_EFFECTS.get(other.effect, ()), *LIMITS.get(other.effect, ()))


def _left_by_best(
    laboratory: _Laboratory, own: Array, draws: Sequence[HiddenEffect], rng: np.random.Generator
) -> float:
    """What the best of some laws leaves, and the best of steps about it."""
    tried = [(_left_by(own, laboratory, each), each) for each in draws]
    for _ in range(ROUNDS):
        left, best = min(tried, key=lambda each: each[0])
        tried = [(left, best)]
        tried += [(_left_by(own, laboratory, each), each) for each in (_stepped(best, rng) for _ in range(STEPS))]
    return min(each[0] for each in tried)


def _stepped(effect: HiddenEffect, rng: np.random.Generator) -> HiddenEffect:
    """The same law with other numbers nearby."""
    moved = {
        name: value if name in HELD_NUMBERS else float(value * (1 + STEP_SHARE * rng.normal()))
        for name, value in effect.shape.items()
    }
    return replace(effect, shape=moved)


def _left_by(own: Array, laboratory: _Laboratory, other: HiddenEffect) -> float:
    rows = laboratory.rows(other)
    power, shared = float(rows @ rows), float(own @ rows)
    if other.takes_energy:
        shared = max(shared, 0.0)
    return float(own @ own) - (shared**2 / power if power > 0 else 0.0)


def _left_by_all(own: Array, others: Sequence[Array]) -> float:
    rest = own - np.column_stack(others) @ np.linalg.lstsq(np.column_stack(others), own, rcond=1e-9)[0]
    return float(rest @ rest)
