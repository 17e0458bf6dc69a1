"""What one case is to be: drawn from its seed and number alone, before anything is simulated."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from concealed.arms import Machine, machine
from concealed.bodies import with_stretched_link
from concealed.effects.channels import Offset
from concealed.effects.friction import Coulomb, Viscous
from concealed.effects.hidden import Hidden, size_of
from concealed.effects.library import LIBRARY
from concealed.motions import FAMILIES
from concealed.noise import JUDGED, USUAL, Noise, draw_noise
from concealed.outside import OUTSIDE
from concealed.streams import stream
from problem.arm import Arm

Tier = Literal["clean", "realistic"]
Kind = Literal["single", "pair", "triple", "outside", "decoy", "null"]
ARMS = {"irb120-arm": 0.5, "irb120": 0.2, "panda": 0.15, "scara": 0.15}
KINDS: dict[Kind, float] = {"single": 0.5, "pair": 0.12, "triple": 0.06, "outside": 0.16, "decoy": 0.08, "null": 0.08}
COUNTS = {"single": 1, "pair": 2, "triple": 3, "outside": 1, "decoy": 0, "null": 0}
SMALLEST, LARGEST = 0.5, 20.0  # detection limits
BACKGROUND = ("coulomb_friction", "viscous_friction", "torque_offset", "inertial_parameter_error", "payload")
DEVELOPMENT_SEEDS = range(1000, 2000)


@dataclass(frozen=True)
class RunPlan:
    """One run: its family of motions, its length in s, and what it is for."""

    family: str
    length_s: float
    role: Literal["identify", "validate"]


@dataclass(frozen=True, eq=False)
class Plan:
    """One case. true_arm: without the hidden effects, but with links that are off. background: friction."""

    seed: int
    index: int
    tier: Tier
    kind: Kind
    machine: Machine
    runs: tuple[RunPlan, ...]
    rate_hz: int
    noise: Noise
    true_arm: Arm
    cad_errors: tuple[float, ...]
    background: tuple[Hidden, ...]

    @property
    def realistic(self) -> bool:
        """True in the realistic tier."""
        return self.tier == "realistic"

    @property
    def name(self) -> str:
        """A name that tells nothing."""
        return stream("name", self.seed, self.tier, self.index, self.kind == "null").bytes(6).hex()

    def stream(self, what: str) -> np.random.Generator:
        """The case's random numbers for one purpose."""
        return stream(what, self.seed, self.tier, self.index)


def draw_plan(seed: int, index: int, tier: Tier, only_nulls: bool, development: bool) -> Plan:
    """The plan of a case. development: leaves out the kinds of noise that are kept for judged sets."""
    rng = stream("plan", seed, tier, index, only_nulls)
    kind: Kind = "null" if only_nulls else _kind(index, seed, tier)
    made = machine(str(rng.choice(list(ARMS), p=list(ARMS.values()))))
    realistic = tier == "realistic"
    noise = draw_noise(rng, _noise_kind(rng, kind, realistic, development), made.rating, realistic)
    arm, errors = _drawn_arm(rng, made, realistic or kind == "decoy", kind)
    background = _background(rng, made) if realistic else ()
    rate = int(rng.choice([250, 500, 1000], p=[0.3, 0.5, 0.2]))
    return Plan(seed, index, tier, kind, made, _runs(rng), rate, noise, arm, errors, background)


def draw_effects(plan: Plan, attempt: int) -> tuple[Hidden, ...]:
    """The effects of a case with their usual sizes; the next attempt where they cannot be seen.

    No two at one joint of one channel: an effect comes once a case, and only one needs parts of its own.
    """
    rng = stream("effects", plan.seed, plan.tier, plan.index, attempt)
    library = OUTSIDE if plan.kind == "outside" else _library(plan)
    chosen: list[Hidden] = []
    first = _cycled(plan, attempt, len(library))
    order = [first, *(int(other) for other in rng.permutation(len(library)) if other != first)]
    for number in order:
        if len(chosen) == COUNTS[plan.kind]:
            break
        places = list(library[number].places(plan.machine))
        if not places:
            continue
        drawn = library[number].draw(rng, plan.machine, int(rng.choice(places)))
        if _fits(drawn, chosen):
            chosen.append(drawn)
    return tuple(chosen)


def target_multiple(plan: Plan, number: int) -> float:
    """Detection limits aimed at: log-uniform, evenly spread over the cases of a set."""
    golden = (np.sqrt(5) - 1) / 2
    start = stream("sizes", plan.seed, plan.tier).random()
    share = (start + golden * plan.index + 0.381966 * number) % 1
    return float(SMALLEST * (LARGEST / SMALLEST) ** share)


def _library(plan: Plan) -> tuple[type[Hidden], ...]:
    """In the realistic tier without what is in the background anyway."""
    return tuple(kind for kind in LIBRARY if not plan.realistic or kind.effect not in BACKGROUND)


def _cycled(plan: Plan, attempt: int, size: int) -> int:
    """Each effect comes once before any comes twice."""
    block, place = divmod(plan.index, size)
    order = stream("order", plan.seed, plan.tier, plan.kind == "outside", block).permutation(size)
    return int(order[(place + 7 * attempt) % size])


def _fits(drawn: Hidden, chosen: list[Hidden]) -> bool:
    own = [each for each in chosen if each.has_parts]
    return not (drawn.has_parts and own) and drawn.effect not in {each.effect for each in chosen}


def _kind(index: int, seed: int, tier: str) -> Kind:
    """Spread evenly over the cases of a set, so that a small set has some of each."""
    share = (stream("kind", seed, tier).random() + (np.sqrt(2) - 1) * index) % 1
    for kind, end in zip(KINDS, np.cumsum(list(KINDS.values())), strict=True):
        if share < end:
            return kind
    return "null"


def _noise_kind(rng: np.random.Generator, kind: Kind, realistic: bool, development: bool) -> str:
    special = bool(rng.random() < 0.5) and kind == "null" and not development
    usual = "coloured" if realistic else str(rng.choice(USUAL))
    return str(rng.choice(JUDGED)) if special else usual


def _drawn_arm(rng: np.random.Generator, made: Machine, off: bool, kind: Kind) -> tuple[Arm, tuple[float, ...]]:
    """The arm with links that are 3-10 % off (a decoy of the clean tier: up to 20 %), and how much each is."""
    arm, errors = made.arm, list[float]()
    most = 0.2 if kind == "decoy" else 0.1
    for number, link in enumerate(arm.links or ()) if off else ():
        error = float(rng.uniform(0.03, most))
        mass, spread = 1 + error * rng.choice([-1, 1]), 1 + error * rng.uniform(-1, 1)
        reach = float(np.linalg.norm(np.array(link.first_moment))) / link.mass
        shift = error * max(reach, 0.02) * rng.uniform(-1, 1, 3)
        arm, errors = with_stretched_link(arm, number, float(mass), shift, float(spread)), [*errors, error]
    return arm, tuple(errors)


def _background(rng: np.random.Generator, made: Machine) -> tuple[Hidden, ...]:
    """Coulomb and viscous friction on every joint, offsets on half of them."""
    out: list[Hidden] = []
    for joint in range(made.joints):
        level, slope, offset = (
            size_of(float(share), made, joint) for share in rng.uniform((0.02, 0.02, 0.002), (0.07, 0.07, 0.01))
        )
        out += [
            Coulomb(joint, level, np.inf, "sign", {"width": 0.0}),
            Viscous(joint, slope, np.inf, "linear", {"phase": 0.0}),
        ]
        if rng.random() < 0.5:
            out.append(Offset(joint, offset, np.inf, "constant", {"direction": float(rng.choice([-1, 1]))}))
    return tuple(out)


def _runs(rng: np.random.Generator) -> tuple[RunPlan, ...]:
    """Two or three runs of one or two families, and one of another family to validate."""
    families = [str(name) for name in rng.permutation(list(FAMILIES))]
    number = int(rng.integers(2, 4))
    identify = [RunPlan(families[run % 2], float(rng.uniform(10, 15)), "identify") for run in range(number)]
    return (*identify, RunPlan(families[2], float(rng.uniform(10, 12)), "validate"))
