"""Effects of bodies: links, lengths and gravity that differ from the simulation."""

from collections.abc import Sequence
from dataclasses import replace
from typing import ClassVar, Self

import numpy as np

from armlab.proof.blind.arms import Machine, with_body, with_longer_link, with_stretched_link, with_tilt
from armlab.proof.blind.effects.hidden import HiddenEffect, ParameterValues
from problem.arm import Arm
from problem.pseudo_inertia import link_from_centre_of_mass


class Payload(HiddenEffect):
    """A compact body on a link, mostly the last; other form: a long body. size: mass, kg."""

    effect, forms = "payload", ("compact", "long")
    where = "link"
    units: ClassVar = {"mass": "kg", "centre": "m"}

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """The last link, three times as often as each of the two before it."""
        last = machine.joints - 1
        return [last, last, last, *(link for link in (last - 1, last - 2) if link > 0)]

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        x, y, z = rng.uniform((-0.04, -0.04, -0.02), (0.04, 0.04, 0.12))
        shape = {"x": float(x), "y": float(y), "z": float(z), "radius": float(rng.uniform(0.03, 0.08))}
        return cls(joint, 1.0, 6.0, cls.draw_form(rng), shape)

    @property
    def comparable(self) -> tuple[str, ...]:
        return ("mass",)

    @property
    def centre(self) -> list[float]:
        """Centre of mass in the link's frame, m."""
        return [self.shape[axis] for axis in "xyz"]

    def parameters(self) -> ParameterValues:
        return {"mass": self.size, "centre": self.centre}

    def arm(self, arm: Arm) -> Arm:
        long = 16.0 if self.form == "long" else 1.0
        inertia = 0.4 * self.size * self.shape["radius"] ** 2 * np.diag([1, 1, long]) / max(1.0, long / 2)
        inertia[2, 2] = min(inertia[2, 2], inertia[0, 0] + inertia[1, 1])
        return with_body(arm, self.joint, link_from_centre_of_mass(self.size, np.array(self.centre), inertia))


class LinkError(HiddenEffect):
    """A link that is heavier than its model and has another centre and inertia. size: relative error of the mass."""

    effect, forms = "inertial_parameter_error", ("mass and centre",)
    where = "link"

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        x, y, z = rng.uniform(-0.02, 0.02, 3)
        shape = {"x": float(x), "y": float(y), "z": float(z), "spread": float(rng.uniform(-0.3, 0.5))}
        return cls(joint, 0.1, 1.0, cls.draw_form(rng), shape)

    @property
    def comparable(self) -> tuple[str, ...]:
        """None: the arm decides which of the ten parameters can be identified."""
        return ()

    def parameters(self) -> ParameterValues:
        return {}

    def arm(self, arm: Arm) -> Arm:
        shift = 10 * self.size * np.array([self.shape[axis] for axis in "xyz"])
        spread = float(np.exp(10 * self.size * np.log1p(self.shape["spread"])))
        return with_stretched_link(arm, self.joint, 1 + self.size, shift, min(max(spread, 0.3), 3.0))


class Tilt(HiddenEffect):
    """A base that is not level. size: angle, rad."""

    effect, forms = "base_tilt", ("tilt",)
    where = "robot"
    units: ClassVar = {"gravity": "m/s2"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 0.017, 0.2, cls.draw_form(rng), {"direction": float(rng.uniform(0, 2 * np.pi))})

    @property
    def comparable(self) -> tuple[str, ...]:
        """None: a direction needs another measure of error than a number."""
        return ()

    def parameters(self) -> ParameterValues:
        """Gravity in the base frame."""
        return {"gravity": [float(value) for value in self._tilted((0.0, 0.0, -9.81))]}

    def arm(self, arm: Arm) -> Arm:
        about = self.size * np.array([np.cos(self.shape["direction"]), np.sin(self.shape["direction"])])
        return with_tilt(arm, float(about[0]), float(about[1]))

    def _tilted(self, gravity: tuple[float, float, float]) -> tuple[float, float, float]:
        return self.arm(replace(Arm("", ()), gravity=gravity)).gravity


class Geometry(HiddenEffect):
    """A link that is longer along x (`a`), or a joint that lies further along its axis (`d`). size: m."""

    effect, forms = "geometry_error", ("a", "d")
    units: ClassVar = {"offset": "m"}

    @classmethod
    def places(cls, machine: Machine) -> Sequence[int]:
        """All joints but the last, which carries nothing."""
        return range(max(machine.joints - 1, 1))

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        return cls(joint, 5e-3, 6e-2, cls.draw_form(rng))

    @property
    def comparable(self) -> tuple[str, ...]:
        """None: a finding names the axis as well."""
        return ()

    def parameters(self) -> ParameterValues:
        return {"offset": self.size}

    def arm(self, arm: Arm) -> Arm:
        return with_longer_link(arm, self.joint, self.form, self.size)
