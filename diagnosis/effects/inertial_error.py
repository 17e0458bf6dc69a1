"""A link whose inertial parameters are not those of the simulation."""

from dataclasses import dataclass

from diagnosis.effects.body import Body, LinkFamily
from diagnosis.effects.link_columns import felt_parameters
from problem.arm import Arm
from recordings.run import Array


@dataclass(frozen=True)
class InertialError(Body):
    """What has to be added to a link's parameters, of either sign."""

    effect = "inertial_parameter_error"

    @classmethod
    def shown(cls, arm: Arm, link: int) -> bool:
        """Whether the arm feels anything of the link."""
        return bool(felt_parameters(arm, link)[0])

    def objection(self, coefficients: Array, covariance: Array | None = None) -> str | None:
        """None: the simulation's link may be too heavy as well as too light."""
        return None


INERTIAL_ERROR = LinkFamily("inertial_parameter_error", (InertialError,))
