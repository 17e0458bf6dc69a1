"""The plan of a case: a simulated or a public recording, and the mistakes that are put into it."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from armlab.common.errors import InputError
from armlab.proof.blind.plan import DEVELOPMENT_SEEDS, Plan, draw_plan, random_stream
from armlab.proof.blind.setup.mistakes import EFFECTS, Injected, draw_mistake
from armlab.recordings.load import load_recording
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_recording
from armlab.recordings.recording_file import FILE_NAME
from problem.arm import Arm
from problem.robot_file import load_arm

Source = Literal["simulated", "real", "null"]
Kind = Literal["alone", "pair", "beside physics", "none", "near miss"]
PUBLIC = ("kuka-kr300", "emps", "staubli-tx40", "unisa-ur10", "unisa-panda")
KIND_CYCLE: tuple[Kind, ...] = ("alone", "alone", "pair", "beside physics")
NULL_CYCLE: tuple[Kind, ...] = ("none", "near miss", "none")
MAX_DRAWS = 60


@dataclass(frozen=True)
class SetupCase:
    """One case. index: among those of its source.

    recording: a public one, or a folder of the local copies; empty for a simulated one.
    """

    seed: int
    source: Source
    index: int
    kind: Kind
    recording: str = ""

    @property
    def name(self) -> str:
        """A random name, which says nothing about the case."""
        return random_stream("setup name", self.seed, self.source, self.index).bytes(6).hex()

    @property
    def effects(self) -> tuple[str, ...]:
        """The effects, each comes once before any comes twice."""
        if self.kind in ("none", "near miss"):
            return ()
        order = random_stream("setup order", self.seed, self.source).permutation(len(EFFECTS))
        first = EFFECTS[order[self.index % len(EFFECTS)]]
        second = EFFECTS[order[(self.index * 5 + 3) % len(EFFECTS)]]
        return (first, second) if self.kind == "pair" and second != first else (first,)

    @property
    def has_physics(self) -> bool:
        """Whether physics is hidden in it."""
        return self.kind == "beside physics" or (self.source == "null" and self.index % 2 == 1)

    @property
    def right_gravity(self) -> tuple[float, float, float]:
        """Gravity in the base frame as it is, m/s2."""
        if not self.recording:
            return self.plan().true_arm.gravity
        if self.recording in PUBLIC:
            return load_arm(self.recording).gravity
        return load_recording(local_folder(self.recording)).arm.gravity

    def plan(self) -> Plan:
        """The simulated recording."""
        development = self.seed in DEVELOPMENT_SEEDS
        plan = draw_plan(self.seed, self.index, "realistic", not self.has_physics, development)
        return _hang(plan, self) if self.kind == "near miss" else plan


def local_folder(name: str) -> Path:
    """A recording folder with a D-H table among the local copies; InputError where there is none."""
    folder = local_recording(name)
    if folder is None or not (folder / "robot.yaml").is_file():
        raise InputError(f"no folder {name} with {FILE_NAME} and robot.yaml directly below {LOCAL_COPIES_VARIABLE}")
    return folder


def draw_cases(seed: int, simulated: int, real: int, nulls: int, folders: tuple[str, ...] = ()) -> Iterator[SetupCase]:
    """All cases of a set. folders: recordings of the local copies beside the public ones."""
    recordings = (*PUBLIC, *folders)
    for index in range(simulated):
        yield SetupCase(seed, "simulated", index, KIND_CYCLE[index % len(KIND_CYCLE)])
    for index in range(real):
        kind: Kind = "pair" if index % 4 == 3 else "alone"
        yield SetupCase(seed, "real", index, kind, recordings[index % len(recordings)])
    for index in range(nulls):
        yield SetupCase(seed, "null", index, NULL_CYCLE[index % len(NULL_CYCLE)])


def draw_mistakes(case: SetupCase, arm: Arm) -> tuple[Injected, ...]:
    """The mistakes of a case on an arm; an effect that has no place there gives way to another one."""
    rng = random_stream("setup mistakes", case.seed, case.source, case.index)
    out: list[Injected] = []
    for wanted in case.effects:
        effect = wanted
        for _ in range(MAX_DRAWS):
            drawn = draw_mistake(rng, effect, arm)
            if drawn is not None and drawn.effect not in [each.effect for each in out]:
                out.append(drawn)
                break
            effect = str(rng.choice(EFFECTS))
    return tuple(out)


def _hang(plan: Plan, case: SetupCase) -> Plan:
    """The plan of an arm that really hangs, or stands on a wall, and whose file says so."""
    rng = random_stream("setup mount", case.seed, case.index)
    axis = np.array([(0.0, 0.0, 9.81), (9.81, 0.0, 0.0), (0.0, -9.81, 0.0)][int(rng.integers(3))])
    gravity = (float(axis[0]), float(axis[1]), float(axis[2]))
    machine = replace(plan.machine, file=plan.machine.file.model_copy(update={"gravity": gravity}))
    return replace(plan, machine=machine, true_arm=replace(plan.true_arm, gravity=gravity))
