"""The preset `tell-apart`: a discriminating motion as a problem that configurations name and algorithms compare on."""

from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from annotated_types import Ge, Gt
from pydantic import Field

from diagnosis.next.design import Budget, excitation
from diagnosis.next.prepare import Links, prepare
from diagnosis.next.problem import TellApartProblem, tell_apart_problem
from diagnosis.next.question import Name
from diagnosis.next.verdict_file import Finding, VerdictFile
from problem.arm import Arm
from problem.errors import InputError
from problem.frame import ShiftedProblem, in_random_frame
from problem.limit_settings import LimitSettings, PerJoint, Positive, one_a_joint
from problem.robot_file import load_arm
from problem.settings import Settings
from recordings.vocabulary import EFFECT_IDS


class RivalSettings(Settings):
    """A name that may be right; joint from 1, left out for an effect of the whole robot.

    parameters: [name, value] of the vocabulary, SI units; of the first rival, which the others imitate.
    """

    effect: Literal[EFFECT_IDS]  # type: ignore[valid-type]
    joint: Annotated[int, Ge(1)] | None = None
    parameters: tuple[tuple[str, float | tuple[float, ...]], ...] = ()


class MotionLimitSettings(LimitSettings):
    """Limits of a moderate motion: 2 rad/s and 10 rad/s2; null leaves the robot file's."""

    velocity: PerJoint | None = 2.0
    acceleration: PerJoint | None = 10.0


VISCOUS_OR_LATE = (
    RivalSettings(effect="viscous_friction", joint=2, parameters=(("coefficient", 0.3),)),
    RivalSettings(effect="time_delay"),
)


class TellApartSettings(Settings):
    """Find the motion, from rest to rest within all limits, on which rivals differ most.

    arm: a built-in name or a file. noise: N m, of the torque below cutoff_hz. links: how well they are known: exactly,
    nearly (8 % off), or not at all. frame_seed: search in randomly shifted coordinates.
    """

    preset: Literal["tell-apart"] = "tell-apart"
    arm: str = "irb120-arm"
    joints: Annotated[int, Ge(1)] | None = None
    rivals: Annotated[tuple[RivalSettings, ...], Field(min_length=2)] = VISCOUS_OR_LATE
    duration: Positive = 10.0
    harmonics: Annotated[int, Ge(2)] = 8
    noise: PerJoint = 0.05
    cutoff_hz: Annotated[float, Gt(0)] = 20.0
    links: Links = "near"
    limits: MotionLimitSettings = MotionLimitSettings()
    frame_seed: Annotated[int, Ge(0)] | None = None

    def build(self) -> TellApartProblem | ShiftedProblem:
        """The problem. Raises InputError where the settings do not fit the arm or no motion separates the rivals."""
        whole = load_arm(self.arm)
        arm = whole.first(min(self.joints or len(whole), len(whole)))
        verdict = self._verdict(arm)
        budget = Budget(duration=self.duration, harmonics=self.harmonics)
        try:
            plain = excitation(arm, self.limits.of(arm), budget)
            groups = (tuple(Name(each.effect, each.joint) for each in self.rivals),)
            prepared = prepare(verdict, groups, arm, plain.trajectory, self.duration, None, self.links)
            problem = tell_apart_problem(prepared, plain)
        except ValueError as error:
            raise InputError(f"tell-apart: {error}") from None
        return problem if self.frame_seed is None else in_random_frame(problem, self.frame_seed)

    def _verdict(self, arm: Arm) -> VerdictFile:
        """What a diagnosis would have said."""
        first, *others = (Name(each.effect, each.joint) for each in self.rivals)
        parameters: dict[str, Any] = dict(self.rivals[0].parameters)
        finding = Finding(first, () if first.joint is None else (first.joint,), parameters, tuple(others))
        noise = np.array(one_a_joint("noise", self.noise, arm))
        model = {"provenance": {"cutoff_hz": self.cutoff_hz}}
        return VerdictFile(Path("tell-apart"), (finding,), noise, model)
