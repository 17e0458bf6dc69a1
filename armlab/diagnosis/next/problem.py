"""The search for a discriminating motion as a problem of the benchmark, and the preset `tell-apart` that names it in
a configuration.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Annotated, Literal

import numpy as np
from annotated_types import Ge, Gt
from pydantic import AfterValidator, Field

from armlab.common.arrays import Array
from armlab.common.derivatives import Derivatives, Question
from armlab.common.errors import DataError, InputError
from armlab.common.settings import Settings
from armlab.diagnosis.next.decision import decision_strength
from armlab.diagnosis.next.derivative import strength_slope
from armlab.diagnosis.next.moments import DesignMoments
from armlab.diagnosis.next.motion import Budget, build_excitation_problem
from armlab.diagnosis.next.prepare import LinkKnowledge, PreparedQuestions, prepare_questions
from armlab.diagnosis.next.question import Name
from armlab.diagnosis.next.verdict_file import VerdictFinding, VerdictWithModel
from armlab.effects.library import effect_named
from problem.arm import Arm
from problem.excitation import ExcitationProblem, ShiftedProblem, shift_randomly
from problem.motion import Motion
from problem.presets import LimitSettings, PerJoint, Positive, per_joint_values
from problem.robot_file import load_arm
from problem.safe_motion import SafeConstraints

MIN_STRENGTH = 1e-6  # standard errors: avoids a division by zero
STEP_SHARE = 1e-7  # of the box: of the differences along its coordinates


@dataclass(frozen=True, eq=False, kw_only=True)
class TellApartProblem(ExcitationProblem):
    """Find the motion that decides best between rivals, together with what was recorded before.

    A point's value is one over its strength, in standard errors.
    """

    prepared: PreparedQuestions

    @property
    def spectral(self) -> bool:
        """Its value is no condition number."""
        return False

    def strength(self, point: Array) -> float:
        """How well the motion of a point (dimension,) decides, standard errors."""
        motion = self.trajectory.motions(point[None], self.times).motion
        return self._strength(motion.select(np.intp(0)))

    @property
    def no_derivatives_because(self) -> str:
        """Why there are no derivatives; empty where there are."""
        if isinstance(self.constraints, SafeConstraints):
            return "derivatives of distances are not known for its motions"
        if any(np.isfinite(limit.torque) for limit in self.constraints.limits):
            return "derivatives of a torque limit are not known"
        return ""

    def differentiate(self, point: Array, question: Question) -> Derivatives:
        """The logarithm of a point's value and its derivatives; limits are kept by every point (dimension,).

        The inner fits are those at the point (`armlab.diagnosis.next.derivative`); the columns of the moved motions,
        one for each coordinate, are differences. sharpness does not matter: the value is smooth but for its kinks.
        """
        step = STEP_SHARE * (self.upper - self.lower)
        motions = self.trajectory.motions(np.vstack([point, point + np.diag(step)]), self.times).motion
        scene, *moved = (
            self.prepared.present.scene(motions.select(np.intp(number)), self.times)
            for number in range(len(motions.position))
        )
        layout, sampling = self.prepared.layout, self.prepared.sampling
        keep = sampling.filter(len(self.times))
        rows = layout.rows(scene, keep, sampling)
        gram = self.prepared.total_gram(self.prepared.learned_share * rows.T @ rows)
        strength, by_gram = strength_slope(self.prepared.questions, gram, self.rows)
        by_row = 2 * self.prepared.learned_share * rows @ by_gram
        changes = np.array([np.sum(by_row * layout.row_changes((scene, each), keep, sampling)) for each in moved])
        value = np.inf if strength < MIN_STRENGTH else -np.log(strength)
        slope = -changes / step / max(strength, MIN_STRENGTH)
        nothing = np.zeros(0, dtype=np.intp)
        return Derivatives(value, slope, np.empty(0), nothing, np.empty((0, len(point))))

    @property
    def rows(self) -> float:
        """Rows of both recordings from which a diagnosis learns, all joints."""
        return self.prepared.rows_with(self.samples)

    def moments(self, point: Array) -> DesignMoments:
        """Moments of the motion of a point (dimension,)."""
        motion = self.trajectory.motions(point[None], self.times).motion.select(np.intp(0))
        return self.prepared.moments(self.prepared.present.scene(motion, self.times))

    def _judge(self, motion: Motion) -> tuple[Array, Array]:
        """Value of motions (points, samples, joints), (points,), twice: it is also what is minimised."""
        strengths = np.array([self._strength(motion.select(np.intp(number))) for number in range(len(motion.position))])
        value = 1 / np.maximum(strengths, MIN_STRENGTH)
        return value, value

    def _strength(self, motion: Motion) -> float:
        moments = self.prepared.moments(self.prepared.present.scene(motion, self.times))
        return decision_strength(self.prepared.questions, self.prepared.total_gram(moments.gram), self.rows)


def tell_apart_problem(
    prepared: PreparedQuestions, excitation: ExcitationProblem, name: str = "tell-apart"
) -> TellApartProblem:
    """The problem for the trajectories and limits of another one; ValueError where no motion separates anything."""
    if not any(question.pairs for question in prepared.questions):
        raise DataError("no motion separates these rivals")
    samples = len(prepared.sampling.times(excitation.duration))
    return TellApartProblem(
        name=name,
        arm=excitation.arm,
        base=excitation.base,
        trajectory=excitation.trajectory,
        duration=(samples - 1) / prepared.sampling.rate_hz,
        samples=samples,
        constraints=excitation.constraints,
        criterion=excitation.criterion,
        penalty=excitation.penalty,
        prepared=prepared,
    )


def _check_effect(name: str) -> str:
    effect_named(name)
    return name


class RivalSettings(Settings):
    """A name that may be right; joint from 1, left out for an effect of the whole robot.

    parameters: [name, value] of the vocabulary, SI units; of the first rival, which the others imitate.
    """

    effect: Annotated[str, AfterValidator(_check_effect)]
    joint: Annotated[int, Ge(1)] | None = None
    parameters: tuple[tuple[str, float | tuple[float, ...]], ...] = ()


class MotionLimitSettings(LimitSettings):
    """Limits of a moderate motion: 2 rad/s and 10 rad/s2; null leaves the robot file's."""

    velocity: PerJoint | None = 2.0
    acceleration: PerJoint | None = 10.0


DEFAULT_RIVALS = (
    RivalSettings(effect="viscous_friction", joint=2, parameters=(("coefficient", 0.3),)),
    RivalSettings(effect="time_delay"),
)


class TellApartSettings(Settings):
    """Find the motion, from rest to rest within all limits, on which rivals differ most.

    arm: a built-in name or a file. noise: N m, of the torque below cutoff_hz. links: `exact` where they are known,
    `near` where they may be off by 8 %, `free` where they are unknown. frame_seed: search in randomly shifted
    coordinates.
    """

    preset: Literal["tell-apart"] = "tell-apart"
    arm: str = "irb120-arm"
    joints: Annotated[int, Ge(1)] | None = None
    rivals: Annotated[tuple[RivalSettings, ...], Field(min_length=2)] = DEFAULT_RIVALS
    duration: Positive = 10.0
    harmonics: Annotated[int, Ge(2)] = 8
    noise: PerJoint = 0.05
    cutoff_hz: Annotated[float, Gt(0)] = 20.0
    links: LinkKnowledge = "near"
    limits: MotionLimitSettings = MotionLimitSettings()
    frame_seed: Annotated[int, Ge(0)] | None = None

    def build(self) -> TellApartProblem | ShiftedProblem:
        """The problem. Raises InputError where the settings do not fit the arm or no motion separates the rivals."""
        whole = load_arm(self.arm)
        arm = whole.first(min(self.joints or len(whole), len(whole)))
        verdict = self._verdict(arm)
        budget = Budget(duration=self.duration, harmonics=self.harmonics)
        try:
            excitation = build_excitation_problem(arm, self.limits.of(arm), budget)
            groups = (tuple(Name(each.effect, each.joint) for each in self.rivals),)
            prepared = prepare_questions(verdict, groups, arm, excitation.trajectory, self.duration, None, self.links)
            problem = tell_apart_problem(prepared, excitation)
        except DataError as error:
            raise InputError(f"tell-apart: {error}") from None
        return problem if self.frame_seed is None else shift_randomly(problem, self.frame_seed)

    def _verdict(self, arm: Arm) -> VerdictWithModel:
        """The verdict that a diagnosis would give if the first rival were right."""
        first, *others = (Name(each.effect, each.joint) for each in self.rivals)
        parameters = dict(self.rivals[0].parameters)
        finding = VerdictFinding(first, () if first.joint is None else (first.joint,), parameters, tuple(others))
        noise = np.array(per_joint_values("noise", self.noise, arm))
        return VerdictWithModel(Path("tell-apart"), (finding,), noise, self.cutoff_hz)


SUITE_1: Mapping[str, TellApartSettings] = MappingProxyType(
    {
        "viscous-or-late": TellApartSettings(),
        "spring-or-compensator": TellApartSettings(
            rivals=(
                RivalSettings(effect="cable_stiffness", joint=2, parameters=(("stiffness", 1.0), ("rest", 0.1))),
                RivalSettings(effect="gravity_compensator", joint=2),
            )
        ),
        "level-load-or-speed": TellApartSettings(
            rivals=(
                RivalSettings(effect="coulomb_friction", joint=2, parameters=(("level", 0.2),)),
                RivalSettings(effect="load_dependent_friction", joint=2),
                RivalSettings(effect="nonlinear_viscous_friction", joint=2),
            )
        ),
    }
)
"""The suite `tell-apart-1`: three questions about the second joint. None is ever changed."""
