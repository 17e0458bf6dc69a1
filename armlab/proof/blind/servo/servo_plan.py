"""The plan of a case: an arm, its simulation file, its motions, what is known, and what is to be hidden."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS, random_stream
from armlab.proof.blind.servo.servo_arms import ARMS, Law, draw_arm
from armlab.proof.blind.servo.servo_commands import FAMILIES, Family, draw_command
from armlab.proof.blind.servo.servo_engine import ServoArm
from armlab.proof.blind.servo.servo_hidden import KINDS, Hidden
from armlab.recordings.recording import Role

Kind = Literal["null", "one", "two"]
Knowledge = Literal["known", "partly", "unknown"]
LAW_CYCLE: tuple[Law, ...] = ("pd", "pd", "pid", "pd", "cascade")
KNOWLEDGE_CYCLE: tuple[Knowledge, ...] = ("known", "known", "partly", "known", "unknown", "known", "known")
HIDDEN_CYCLE: tuple[Kind, ...] = ("one", "one", "two")
MOTIONS = (4, 8)  # of a recording, the last number included
HELD_OUT = (2, 3)
LEAST_IDENTIFY = 2
LENGTH_S = (8.0, 12.0)
MULTIPLES = (1.0, 12.0)  # detection limits


@dataclass(frozen=True, eq=False)
class MotionRun:
    """One motion. command: (samples, joints), rad, REST_S before the record included."""

    family: Family
    role: Role
    command: Array


@dataclass(frozen=True)
class ServoCase:
    """A case of a set. Development sets leave out cascades."""

    seed: int
    kind: Kind
    index: int

    def stream(self, what: str) -> np.random.Generator:
        """Random numbers for one purpose."""
        return random_stream("servo", what, self.seed, self.kind == "null", self.index)

    @property
    def name(self) -> str:
        """A random name, which says nothing about the case."""
        return self.stream("name").bytes(6).hex()

    @property
    def development(self) -> bool:
        """Whether the seed is one for development."""
        return self.seed in DEVELOPMENT_SEEDS

    @property
    def law(self) -> Law:
        """Of the drives. Only drives of which the recording says nothing are cascades with an integral gain."""
        law = LAW_CYCLE[self.index % len(LAW_CYCLE)]
        if law != "cascade":
            return law
        return "pd" if self.development else "PI cascade" if self.knowledge == "unknown" else law

    @property
    def knowledge(self) -> Knowledge:
        """What the recording says of the controller: all, all but kp, or nothing."""
        return KNOWLEDGE_CYCLE[self.index % len(KNOWLEDGE_CYCLE)]

    @cached_property
    def drawn(self) -> tuple[ServoArm, Array]:
        """The arm as the simulation file has it, and its home, (joints,), rad."""
        arm, home = draw_arm(self.stream("arm"), self.law)
        phase = int(self.stream("phase").integers(self.hold)) / self.rate_hz
        return ServoArm(arm.bodies, arm.servos, self.hold / self.rate_hz, phase), home

    @property
    def rate_hz(self) -> float:
        """Of samples and commands."""
        return float(self.stream("rate").choice(ARMS.rate_hz))

    @property
    def hold(self) -> int:
        """Of so many commands a drive takes the first one and holds it; 1 where the recording does not say it."""
        if self.knowledge == "unknown":
            return 1
        usable = [count for count in ARMS.hold if self.rate_hz / count >= ARMS.least_hold_hz]
        return int(self.stream("hold").choice(usable))

    @property
    def read_gap_s(self) -> float:
        """Between the readings of two joints, the first at the stamp; only where the recording says it.

        All joints are read within an interval of the samples.
        """
        gap = 0.0 if self.knowledge == "unknown" else float(self.stream("read").uniform(*ARMS.read_gap_s))
        return min(gap, 1 / (self.rate_hz * self.drawn[0].joints))

    @property
    def jitter_s(self) -> float:
        """Standard deviation by which stamps are late."""
        return float(self.stream("jitter").uniform(*ARMS.jitter_s))

    @cached_property
    def runs(self) -> tuple[MotionRun, ...]:
        """The motions; the last ones are held out, and each family comes before any comes twice."""
        rng = self.stream("motions")
        count = int(rng.integers(MOTIONS[0], MOTIONS[1] + 1))
        held_out = min(int(rng.integers(HELD_OUT[0], HELD_OUT[1] + 1)), count - LEAST_IDENTIFY)
        families = [*rng.permutation(FAMILIES), *rng.choice(FAMILIES, count)][:count]
        home = self.drawn[1]
        out = []
        for number, family in enumerate(families):
            role: Role = "validate" if number >= count - held_out else "identify"
            length = float(rng.uniform(*LENGTH_S))
            command = draw_command(rng, family, home, self.rate_hz, length)
            count_rad = self.drawn[0].servos[0].count
            out.append(MotionRun(family, role, np.rint(command / count_rad) * count_rad))
        return tuple(out)

    @property
    def multiples(self) -> tuple[float, ...]:
        """Wanted sizes of what is hidden, in detection limits, log-uniform."""
        count = {"null": 0, "one": 1, "two": 2}[self.kind]
        low, high = np.log(MULTIPLES)
        return tuple(np.exp(self.stream("multiples").uniform(low, high, count)).tolist())

    def draw_hidden(self, place: int, attempt: int) -> Hidden:
        """What is to be hidden at a place, without its size; each kind comes once before any comes twice."""
        rng = self.stream(f"hidden {place} {attempt}")
        usable = [kind for kind, facts in KINDS.items() if self.knowledge == "known" or not facts.of_drive]
        order = random_stream("servo order", self.seed, place).permutation(len(usable))
        kind = usable[order[self.index % len(usable)]] if attempt == 0 else str(rng.choice(usable))
        sign = float(rng.choice([-1, 1])) if KINDS[kind].both_ways else 1.0
        falling = kind == "saturation" and bool(rng.random() < 0.5)
        joint = int(rng.integers(self.drawn[0].joints))
        return Hidden(kind, joint, sign, falling=falling, shape=float(rng.uniform(0.03, 0.15)))


def draw_cases(seed: int, cases: int, nulls: int) -> Iterator[ServoCase]:
    """All cases of a set."""
    for index in range(cases):
        yield ServoCase(seed, HIDDEN_CYCLE[index % len(HIDDEN_CYCLE)], index)
    for index in range(nulls):
        yield ServoCase(seed, "null", index)
