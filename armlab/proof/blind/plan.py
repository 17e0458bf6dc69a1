"""The plan of a case: drawn from its seed and number alone, before anything is simulated."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from armlab.common.streams import named_generator
from armlab.proof.blind.arms import Machine, make_machine, with_stretched_link
from armlab.proof.blind.effects.channels import Offset
from armlab.proof.blind.effects.friction import Coulomb, Viscous
from armlab.proof.blind.effects.hidden import HiddenEffect, torque_share
from armlab.proof.blind.effects.library import LIBRARY
from armlab.proof.blind.formats import CaseKind, EngineName, Tier
from armlab.proof.blind.motions import FAMILIES
from armlab.proof.blind.noise import JUDGED_KINDS, USUAL_KINDS, Noise, draw_noise
from armlab.proof.blind.outside import OUTSIDE
from problem.arm import Arm


def random_stream(*names: str | int) -> np.random.Generator:
    """The generator of these names, independent of every one outside of the truth machine."""
    return named_generator("concealed", *names)


ARM_SHARES = {"irb120-arm": 0.5, "irb120": 0.2, "panda": 0.15, "scara": 0.15}
KIND_SHARES: dict[CaseKind, float] = {
    "single": 0.5,
    "pair": 0.12,
    "triple": 0.06,
    "outside": 0.16,
    "decoy": 0.08,
    "null": 0.08,
}
EFFECT_COUNTS = {"single": 1, "pair": 2, "triple": 3, "outside": 1, "decoy": 0, "null": 0}
BACKGROUND_EFFECTS = ("coulomb_friction", "viscous_friction", "torque_offset", "inertial_parameter_error", "payload")
DEVELOPMENT_SEEDS = range(1000, 2000)


@dataclass(frozen=True)
class PlanSettings:
    """What a case is drawn from; fixed before any diagnosis was scored.

    multiples: sizes of hidden effects, detection limits. link_error, decoy_link_error: relative errors of links. rates:
    share of each sample rate, Hz. coulomb, viscous, offset: of the background, share of the rating (viscous: at 1
    rad/s). offset_share: joints with an offset. identify_s, validate_s: length of a run.
    sticking_share: cases of a set that the second engine simulates.
    """

    multiples: tuple[float, float] = (0.5, 20.0)
    link_error: tuple[float, float] = (0.03, 0.1)
    decoy_link_error: tuple[float, float] = (0.03, 0.2)
    rates: tuple[tuple[int, float], ...] = ((250, 0.3), (500, 0.5), (1000, 0.2))
    coulomb: tuple[float, float] = (0.02, 0.07)
    viscous: tuple[float, float] = (0.02, 0.07)
    offset: tuple[float, float] = (0.002, 0.01)
    offset_share: float = 0.5
    identify_s: tuple[float, float] = (10, 15)
    validate_s: tuple[float, float] = (10, 12)
    sticking_share: float = 1 / 3


PLAN = PlanSettings()


@dataclass(frozen=True)
class RunPlan:
    """One run: its family of motions, its length in s, and what it is for."""

    family: str
    length_s: float
    role: Literal["identify", "validate"]


@dataclass(frozen=True, eq=False)
class Plan:
    """One case. true_arm: without the hidden effects, but with links that are off. background: friction.

    engine: MuJoCo, or the one whose joints stick (`armlab/proof/blind/sticking.py`).
    """

    seed: int
    index: int
    tier: Tier
    kind: CaseKind
    machine: Machine
    runs: tuple[RunPlan, ...]
    rate_hz: int
    noise: Noise
    true_arm: Arm
    cad_errors: tuple[float, ...]
    background: tuple[HiddenEffect, ...]
    engine: EngineName = "mujoco"

    @property
    def realistic(self) -> bool:
        """True in the realistic tier."""
        return self.tier == "realistic"

    @property
    def name(self) -> str:
        """A random name, which says nothing about the case."""
        return random_stream("name", self.seed, self.tier, self.index, self.kind == "null").bytes(6).hex()

    def stream(self, what: str) -> np.random.Generator:
        """Random numbers of the case for one purpose."""
        return random_stream(what, self.seed, self.tier, self.index)


def draw_plan(
    seed: int, index: int, tier: Tier, only_nulls: bool, development: bool, sticking_share: float = 0.0
) -> Plan:
    """The plan of a case. development: leaves out the kinds of noise that are kept for judged sets.

    sticking_share: probability that the second engine simulates it.
    """
    rng = random_stream("plan", seed, tier, index, only_nulls)
    kind: CaseKind = "null" if only_nulls else _choose_kind(index, seed, tier)
    made = make_machine(str(rng.choice(list(ARM_SHARES), p=list(ARM_SHARES.values()))))
    realistic = tier == "realistic"
    noise = draw_noise(rng, _draw_noise_kind(rng, kind, realistic, development), made.rating, realistic)
    arm, errors = _draw_arm(rng, made, realistic or kind == "decoy", kind)
    background = draw_background(rng, made) if realistic else ()
    rate = int(rng.choice([rate for rate, _ in PLAN.rates], p=[share for _, share in PLAN.rates]))
    sticks = random_stream("engine", seed, tier, index, only_nulls).random() < sticking_share
    engine: EngineName = "sticking" if sticks else "mujoco"
    return Plan(seed, index, tier, kind, made, draw_runs(rng), rate, noise, arm, errors, background, engine)


def draw_effects(plan: Plan, attempt: int) -> tuple[HiddenEffect, ...]:
    """The effects of a case with their usual sizes.

    attempt: counts the draws; another one is made if the effects cannot be seen on the arm. An effect comes at most
    once in a case, and at most one effect needs parts of its own.
    """
    rng = random_stream("effects", plan.seed, plan.tier, plan.index, attempt)
    library = OUTSIDE if plan.kind == "outside" else _allowed_effects(plan)
    chosen: list[HiddenEffect] = []
    first = _cycled_index(plan, attempt, len(library))
    order = [first, *(int(other) for other in rng.permutation(len(library)) if other != first)]
    for number in order:
        if len(chosen) == EFFECT_COUNTS[plan.kind]:
            break
        places = list(library[number].places(plan.machine))
        if not places:
            continue
        drawn = library[number].draw(rng, plan.machine, int(rng.choice(places)))
        if _fits_beside(drawn, chosen) and not (drawn.has_parts and plan.engine == "sticking"):
            chosen.append(drawn)
    return tuple(chosen)


def target_multiple(plan: Plan, number: int) -> float:
    """Detection limits aimed at: log-uniform, evenly spread over the cases of a set."""
    golden = (np.sqrt(5) - 1) / 2
    start = random_stream("sizes", plan.seed, plan.tier).random()
    share = (start + golden * plan.index + 0.381966 * number) % 1
    low, high = PLAN.multiples
    return float(low * (high / low) ** share)


def _allowed_effects(plan: Plan) -> tuple[type[HiddenEffect], ...]:
    """The library, in the realistic tier without the effects of the background."""
    return tuple(kind for kind in LIBRARY if not plan.realistic or kind.effect not in BACKGROUND_EFFECTS)


def _cycled_index(plan: Plan, attempt: int, size: int) -> int:
    """Each effect comes once before any comes twice."""
    block, place = divmod(plan.index, size)
    order = random_stream("order", plan.seed, plan.tier, plan.kind == "outside", block).permutation(size)
    return int(order[(place + 7 * attempt) % size])


def _fits_beside(drawn: HiddenEffect, chosen: list[HiddenEffect]) -> bool:
    own = [each for each in chosen if each.has_parts]
    return not (drawn.has_parts and own) and drawn.effect not in {each.effect for each in chosen}


def _choose_kind(index: int, seed: int, tier: str) -> CaseKind:
    """Spread evenly over the cases of a set, so that a small set has some of each."""
    share = (random_stream("kind", seed, tier).random() + (np.sqrt(2) - 1) * index) % 1
    for kind, end in zip(KIND_SHARES, np.cumsum(list(KIND_SHARES.values())), strict=True):
        if share < end:
            return kind
    return "null"


def _draw_noise_kind(rng: np.random.Generator, kind: CaseKind, realistic: bool, development: bool) -> str:
    special = bool(rng.random() < 0.5) and kind == "null" and not development
    usual = "coloured" if realistic else str(rng.choice(USUAL_KINDS))
    return str(rng.choice(JUDGED_KINDS)) if special else usual


def _draw_arm(rng: np.random.Generator, made: Machine, off: bool, kind: CaseKind) -> tuple[Arm, tuple[float, ...]]:
    """The arm with links that are 3-10 % off (a decoy of the clean tier: up to 20 %), and how much each is."""
    arm, errors = made.arm, list[float]()
    error_range = PLAN.decoy_link_error if kind == "decoy" else PLAN.link_error
    if not off:
        return arm, ()
    for number, link in enumerate(arm.links or ()):
        error = float(rng.uniform(*error_range))
        mass, spread = 1 + error * rng.choice([-1, 1]), 1 + error * rng.uniform(-1, 1)
        reach = float(np.linalg.norm(np.array(link.first_moment))) / link.mass
        shift = error * max(reach, 0.02) * rng.uniform(-1, 1, 3)
        arm, errors = with_stretched_link(arm, number, float(mass), shift, float(spread)), [*errors, error]
    return arm, tuple(errors)


def draw_background(rng: np.random.Generator, made: Machine) -> tuple[HiddenEffect, ...]:
    """Coulomb and viscous friction on every joint, offsets on half of them."""
    out: list[HiddenEffect] = []
    for joint in range(made.joints):
        level, slope, offset = rng.uniform(*PLAN.coulomb), rng.uniform(*PLAN.viscous), rng.uniform(*PLAN.offset)
        out += [
            Coulomb(joint, torque_share(level, made, joint), np.inf, "sign", {"width": 0.0}),
            Viscous(joint, torque_share(slope, made, joint), np.inf, "linear", {"phase": 0.0}),
        ]
        if rng.random() < PLAN.offset_share:
            size, direction = torque_share(offset, made, joint), float(rng.choice([-1, 1]))
            out.append(Offset(joint, size, np.inf, "constant", {"direction": direction}))
    return tuple(out)


def draw_runs(rng: np.random.Generator) -> tuple[RunPlan, ...]:
    """Two or three runs of one or two families, and one of another family to validate."""
    families = [str(name) for name in rng.permutation(list(FAMILIES))]
    number = int(rng.integers(2, 4))
    identify = [RunPlan(families[run % 2], float(rng.uniform(*PLAN.identify_s)), "identify") for run in range(number)]
    return (*identify, RunPlan(families[2], float(rng.uniform(*PLAN.validate_s)), "validate"))
