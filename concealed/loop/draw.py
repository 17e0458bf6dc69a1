"""Cases whose names are easily taken for each other: pairs of effects, one of which is hidden."""

from dataclasses import dataclass, replace

import numpy as np

from concealed.effects.hidden import Hidden
from concealed.effects.library import LIBRARY
from concealed.loop.poor import RUNS
from concealed.plan import BACKGROUND, DEVELOPMENT_SEEDS, Plan, Tier, draw_plan
from concealed.streams import stream
from concealed.track import Track

ARM = "irb120-arm"
PAIRS = (  # (hidden, what it is taken for); what no motion can leave alone is not hidden: cables, rotors, loads, gains
    ("time_delay", "viscous_friction"),
    ("load_dependent_friction", "coulomb_friction"),
    ("nonlinear_viscous_friction", "viscous_friction"),
    ("gravity_compensator", "cable_stiffness"),
    ("stribeck_friction", "coulomb_friction"),
    ("presliding_hysteresis", "coulomb_friction"),
    ("channel_skew", "time_delay"),
    ("friction_drift", "viscous_friction"),
    ("encoder_offset", "torque_offset"),
    ("coulomb_friction", "load_dependent_friction"),
    ("viscous_friction", "nonlinear_viscous_friction"),
    ("time_delay", "channel_skew"),
    ("torque_offset", "encoder_offset"),
    ("joint_elasticity", "time_delay"),
)
TIERS: tuple[Tier, ...] = ("clean", "realistic")
REALISTIC = 0.3  # of the draws
MULTIPLES = (1.0, 2.5)  # detection limits that the hidden effect has in the first recording


@dataclass(frozen=True, eq=False)
class Draw:
    """One case before it is simulated. pair: names that are easily confused, the hidden one first."""

    plan: Plan
    pair: tuple[str, str]
    effect: Hidden
    target: float


def draw(seed: int, case: int, attempt: int) -> Draw:
    """The attempt-th draw of a case: the pairs in turn, with and without usual friction and links that are off."""
    rng = stream("loop", seed, case, attempt)
    pair = PAIRS[(case + attempt) % len(PAIRS)]
    tier = TIERS[int(rng.random() < REALISTIC and pair[0] not in BACKGROUND)]  # what every joint has cannot be hidden
    plan = _plan(seed, case, attempt, tier)
    kind = next(each for each in LIBRARY if each.effect == pair[0])
    joint = int(rng.choice(list(kind.places(plan.machine))))
    target = float(np.exp(rng.uniform(*np.log(MULTIPLES))))
    return Draw(plan, pair, kind.draw(rng, plan.machine, joint), target)


def informed(drawn: Draw, tracks: list[Track]) -> Hidden:
    """The effect when the largest torques are known."""
    return drawn.effect.informed(np.max([np.abs(track.load).max(axis=0) for track in tracks], axis=0))


def _plan(seed: int, case: int, attempt: int, tier: Tier) -> Plan:
    """A plan for the three-joint arm; other arms are passed over."""
    for number in range(1000):
        index = (100 * case + attempt) * 1000 + number
        plan = draw_plan(seed, index, tier, only_nulls=False, development=seed in DEVELOPMENT_SEEDS)
        if plan.machine.name == ARM and plan.kind in ("single", "pair", "triple"):
            return replace(plan, kind="single", runs=RUNS, rate_hz=min(plan.rate_hz, 500))
    raise ValueError(f"no plan of seed {seed} is about {ARM}")
