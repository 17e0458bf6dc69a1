"""What an effect of the library promises: columns of torque, named parameters, the signs of physics."""

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence

from armlab.common.arrays import Array
from armlab.effects.extras import Value
from armlab.effects.scene import Scene
from problem.arm import Arm

__all__ = ["Candidate", "Family", "Scene", "Value"]


class Candidate(ABC):
    """An effect at a place, its nonlinear parameters held: linear in its coefficients.

    effect: an id of the vocabulary, or a user's own name. joint: from 1, None for the whole robot, the link for
    parameters of a link. joints: (where the torque appears, where the motion is) for a coupling. rows: the
    joints, from 0, whose torque its columns change. form: which of an effect's laws, where it has several.
    shape: values of the nonlinear parameters, in their order; bounds: one (lowest, highest) a value.
    follows_model: whether its columns depend on `Scene.torque` or `Scene.inertial` and have to be computed anew
    when the model changes. closely: whether they do so on the motion as the filter of the torque leaves it, noise
    included, and not on a calmer one. of_channel: whether it falsifies the torque of all others (a gain, a delay, a
    limit); `Scene.torque` leaves those out, or they would act on themselves. replaces: effects at the same joint
    that its columns contain (Stribeck friction those of Coulomb's); a model has either them or it. looks: among how
    many alternatives a scan of the residual has picked it, for the correction of what was tried.
    """

    effect: str
    joint: int | None
    joints: tuple[int, ...]
    rows: tuple[int, ...]
    form: str = ""
    shape: tuple[float, ...] = ()
    bounds: tuple[tuple[float, float], ...] = ()
    follows_model: bool = False
    follows_closely: bool = False
    replaces: tuple[str, ...] = ()
    of_channel: bool = False
    looks: int = 1

    @abstractmethod
    def columns(self, scene: Scene) -> Array:
        """Torque for each coefficient at one: (samples, len(rows), coefficients), N m (N)."""

    @abstractmethod
    def with_shape(self, shape: tuple[float, ...]) -> "Candidate":
        """The same effect at the same place with other nonlinear parameters."""

    @abstractmethod
    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Parameters by their names in the vocabulary, SI units; the nonlinear ones included.

        A vector (a centre of mass, a direction of gravity) is a tuple.
        """

    @abstractmethod
    def unit(self, name: str) -> str:
        """Unit of one of its parameters."""

    @abstractmethod
    def equation(self, coefficients: Array) -> str:
        """The law with its numbers, like `tau_2 += 2.31 qd_2`."""

    @abstractmethod
    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """Which law of physics these coefficients break beyond their uncertainty, in a few words; else None."""


class Family(ABC):
    """All candidates of one effect. Registered through the entry-point group `armlab.effects`."""

    effect: str

    @abstractmethod
    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """One list a place: the same effect there with each shape worth a first look (one if it has none)."""

    def scan(self, arm: Arm, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[list[Candidate]]:
        """The same after a cheap look at what the present model leaves, where a plain grid is long.

        residuals: one a scene, (samples, joints), N m (N), with NaN where it is not known. A candidate's
        `looks` says how many alternatives the look has compared.
        """
        return self.candidates(arm, scenes)

    def from_parameters(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The candidate and the coefficients that have these parameters, as a model file gives them.

        joints: (joint or link, joint of the motion); empty for the whole robot. form: as in `Candidate.form`;
        the names of the parameters decide where it is left out. Raises ValueError where they do not fit.
        """
        raise ValueError(f"{self.effect} cannot be computed from its parameters")
