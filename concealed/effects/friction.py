"""Friction without memory: functions of velocity, position and load."""

from typing import Self

import numpy as np

from concealed.arms import Machine
from concealed.effects.hidden import Hidden, Values, sign, size_of
from concealed.track import Track
from recordings.run import Array


class Coulomb(Hidden):
    """Level times the sign of velocity; other form: a soft turn-over (arc tangent)."""

    effect, forms = "coulomb_friction", ("sign", "soft")
    blurred = ("level",)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Up to a fifth of the rating."""
        shape = {"width": float(rng.uniform(0.01, 0.05))}
        level = size_of(0.03, machine, joint)
        return cls(joint, level, 7 * level, cls.drawn_form(rng), shape)

    def parameters(self) -> Values:
        """The level."""
        return {"level": self.size}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        velocity = track.velocity[:, self.joint]
        if self.form == "soft":
            return np.asarray(self.size * 2 / np.pi * np.arctan(velocity / self.shape["width"]))
        return self.size * sign(velocity)


class Viscous(Hidden):
    """Proportional to velocity; other form: uneven over the turn by a tenth."""

    effect, forms = "viscous_friction", ("linear", "uneven")
    blurred = ("coefficient",)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Up to a quarter of the rating at 1 rad/s."""
        coefficient = size_of(0.03, machine, joint)
        return cls(joint, coefficient, 8 * coefficient, cls.drawn_form(rng), {"phase": float(rng.uniform(0, 6))})

    def parameters(self) -> Values:
        """The coefficient."""
        return {"coefficient": self.size}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        velocity, position = track.velocity[:, self.joint], track.position[:, self.joint]
        wave = 0.1 * np.sin(2 * position + self.shape["phase"]) if self.form == "uneven" else 0.0
        return np.asarray(self.size * velocity * (1 + wave))


class NonlinearViscous(Hidden):
    """A power of velocity; other form: Eyring's inverse hyperbolic sine of thin oil films."""

    effect, forms = "nonlinear_viscous_friction", ("power", "eyring")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Exponents of churning oil (2 to 3) or of boundary films (below 2/3)."""
        low = bool(rng.random() < 0.4)
        shape = {"exponent": float(rng.uniform(0.3, 0.65) if low else rng.uniform(1.7, 3.0)), "knee": 0.1}
        coefficient = size_of(0.02, machine, joint)
        return cls(joint, coefficient, 10 * coefficient, cls.drawn_form(rng), shape)

    def parameters(self) -> Values:
        """Coefficient and exponent."""
        return {"coefficient": self.size, "exponent": self.shape["exponent"]}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        velocity = track.velocity[:, self.joint]
        if self.form == "eyring":
            return np.asarray(self.size * np.arcsinh(velocity / self.shape["knee"]))
        smooth = sign(velocity) * np.abs(velocity) ** self.shape["exponent"]
        return np.asarray(self.size * smooth)


class Stribeck(Hidden):
    """Friction that falls with speed: Gaussian; other forms: another exponent, or a rational law (Hess 1990).

    size: static level less Coulomb level, N m.
    """

    effect, forms = "stribeck_friction", ("gauss", "exponent", "rational")
    companions, blurred = ("coulomb", "viscous"), ("level", "static_level")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Coulomb level beside it, as in every bearing that has this."""
        fall = size_of(0.02, machine, joint)
        shape = {
            "level": size_of(float(rng.uniform(0.01, 0.05)), machine, joint),
            "velocity": float(np.exp(rng.uniform(np.log(0.025), np.log(0.15)))),
            "exponent": float(rng.uniform(0.6, 1.2)),
        }
        return cls(joint, fall, 8 * fall, cls.drawn_form(rng), shape)

    def parameters(self) -> Values:
        """Levels, velocity, and the exponent of the Gaussian form."""
        level, exponent = self.shape["level"], self.shape["exponent"] if self.form == "exponent" else 2.0
        velocity = self.shape["velocity"]
        return {"level": level, "static_level": level + self.size, "velocity": velocity, "exponent": exponent}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        velocity = track.velocity[:, self.joint]
        ratio = np.abs(velocity) / self.shape["velocity"]
        fall = {
            "gauss": np.exp(-(ratio**2)),
            "exponent": np.exp(-(ratio ** self.shape["exponent"])),
            "rational": 1 / (1 + ratio**2),
        }[self.form]
        return np.asarray(sign(velocity) * (self.shape["level"] + self.size * fall))


class Asymmetric(Hidden):
    """Levels that differ by direction; other form: slopes differ too. size: half the difference, N m."""

    effect, forms = "asymmetric_friction", ("levels", "levels and slopes")
    companions, blurred = ("coulomb", "viscous"), ("positive", "negative")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """About a mean level and slope that are larger than the difference."""
        half = size_of(0.012, machine, joint)
        shape = {"level": float(rng.uniform(1.2, 3)), "slope": float(rng.uniform(1.2, 2))}
        return cls(joint, half, 8 * half, cls.drawn_form(rng), shape)

    @property
    def equivalent(self) -> tuple[str, ...]:
        """Levels alone are a mean level and an offset."""
        return ("coulomb_friction", "torque_offset") if self.form == "levels" else ()

    def parameters(self) -> Values:
        """Levels of both directions."""
        level = self.size * self.shape["level"]
        return {"positive": level + self.size, "negative": level - self.size}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        velocity = track.velocity[:, self.joint]
        direction = sign(velocity)
        torque = self.size * (self.shape["level"] * direction + np.abs(direction))
        if self.form == "levels":
            return np.asarray(torque)
        return np.asarray(torque + self.size * (self.shape["slope"] * velocity + np.abs(velocity)))


class LoadDependent(Hidden):
    """A share of the transmitted torque; other form: a share that fades in with the load."""

    effect, forms = "load_dependent_friction", ("share", "fading in")
    companions = ("coulomb", "viscous")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Up to a third of the load, as in worm and screw gears."""
        shape = {"knee": size_of(0.03, machine, joint), "width": float(rng.uniform(0.002, 0.01))}
        return cls(joint, 0.06, 0.35, cls.drawn_form(rng), shape)

    def parameters(self) -> Values:
        """The share."""
        return {"coefficient": self.size}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        load, knee = track.load[:, self.joint], self.shape["knee"]
        felt = np.abs(load) if self.form == "share" else load**2 / np.sqrt(load**2 + knee**2)
        return np.asarray(self.size * felt * sign(track.velocity[:, self.joint], self.shape["width"]))
