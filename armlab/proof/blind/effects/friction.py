"""Friction: functions of velocity, position and load, presliding hysteresis, and drift with temperature."""

from typing import ClassVar, Self

import numpy as np

from armlab.common.arrays import Array
from armlab.proof.blind.arms import Machine
from armlab.proof.blind.effects.hidden import HiddenEffect, ParameterValues, smooth_sign, torque_share
from armlab.proof.blind.engine import Track


class Coulomb(HiddenEffect):
    """tau = F sgn(v); other form: tau = F (2 / pi) atan(v / w), a soft turn-over. size: F, N m."""

    effect, forms = "coulomb_friction", ("sign", "soft")
    takes_energy = True
    units: ClassVar = {"level": "N.m"}
    blurred = ("level",)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {"width": float(rng.uniform(0.01, 0.05))}
        level = torque_share(0.03, machine, joint)
        return cls(joint, level, 7 * level, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"level": self.size}

    def torque(self, track: Track, run: int) -> Array:
        velocity = track.velocity[:, self.joint]
        if self.form == "soft":
            return np.asarray(self.size * 2 / np.pi * np.arctan(velocity / self.shape["width"]))
        return self.size * smooth_sign(velocity)


class Viscous(HiddenEffect):
    """tau = c v; other form: tau = c (1 + 0.1 sin(2 q + p)) v, uneven over the turn. size: c, N m s/rad."""

    effect, forms = "viscous_friction", ("linear", "uneven")
    takes_energy = True
    units: ClassVar = {"coefficient": "N.m.s/rad"}
    blurred = ("coefficient",)

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        coefficient = torque_share(0.03, machine, joint)
        return cls(joint, coefficient, 8 * coefficient, cls.draw_form(rng), {"phase": float(rng.uniform(0, 6))})

    def parameters(self) -> ParameterValues:
        return {"coefficient": self.size}

    def torque(self, track: Track, run: int) -> Array:
        velocity, position = track.velocity[:, self.joint], track.position[:, self.joint]
        wave = 0.1 * np.sin(2 * position + self.shape["phase"]) if self.form == "uneven" else 0.0
        return np.asarray(self.size * velocity * (1 + wave))


class NonlinearViscous(HiddenEffect):
    """tau = c sgn(v) |v|^n; other form: tau = c asinh(v / v0), Eyring's law of thin oil films. size: c."""

    effect, forms = "nonlinear_viscous_friction", ("power", "eyring")
    takes_energy = True
    units: ClassVar = {"coefficient": "N.m/(rad/s)^exponent", "exponent": "1"}

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Exponents of churning oil (1.7 to 3) or of boundary films (0.3 to 0.65)."""
        low = bool(rng.random() < 0.4)
        shape = {"exponent": float(rng.uniform(0.3, 0.65) if low else rng.uniform(1.7, 3.0)), "knee": 0.1}
        coefficient = torque_share(0.02, machine, joint)
        return cls(joint, coefficient, 10 * coefficient, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"coefficient": self.size, "exponent": self.shape["exponent"]}

    def torque(self, track: Track, run: int) -> Array:
        velocity = track.velocity[:, self.joint]
        if self.form == "eyring":
            return np.asarray(self.size * np.arcsinh(velocity / self.shape["knee"]))
        smooth = smooth_sign(velocity) * np.abs(velocity) ** self.shape["exponent"]
        return np.asarray(self.size * smooth)


class Stribeck(HiddenEffect):
    """tau = sgn(v) (F + S g(|v| / vs)): friction that falls with speed.

    g(x): exp(-x^2); other forms: exp(-x^n), or 1 / (1 + x^2) (Hess 1990). size: S, static less Coulomb level, N m.
    """

    effect, forms = "stribeck_friction", ("gauss", "exponent", "rational")
    takes_energy = True
    units: ClassVar = {"level": "N.m", "static_level": "N.m", "velocity": "rad/s", "exponent": "1"}
    companions, blurred = ("coulomb", "viscous"), ("level", "static_level")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        fall = torque_share(0.02, machine, joint)
        shape = {
            "level": torque_share(float(rng.uniform(0.01, 0.05)), machine, joint),
            "velocity": float(np.exp(rng.uniform(np.log(0.025), np.log(0.15)))),
            "exponent": float(rng.uniform(0.6, 1.2)),
        }
        return cls(joint, fall, 8 * fall, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        level, exponent = self.shape["level"], self.shape["exponent"] if self.form == "exponent" else 2.0
        velocity = self.shape["velocity"]
        return {"level": level, "static_level": level + self.size, "velocity": velocity, "exponent": exponent}

    def torque(self, track: Track, run: int) -> Array:
        velocity = track.velocity[:, self.joint]
        ratio = np.abs(velocity) / self.shape["velocity"]
        fall = {
            "gauss": np.exp(-(ratio**2)),
            "exponent": np.exp(-(ratio ** self.shape["exponent"])),
            "rational": 1 / (1 + ratio**2),
        }[self.form]
        return np.asarray(smooth_sign(velocity) * (self.shape["level"] + self.size * fall))


class Asymmetric(HiddenEffect):
    """tau = D (k sgn(v) + 1): levels that differ by direction.

    Other form: + D (s v + |v|), slopes that differ too. size: D, half the difference, N m.
    """

    effect, forms = "asymmetric_friction", ("levels", "levels and slopes")
    units: ClassVar = {"positive": "N.m", "negative": "N.m"}
    companions, blurred = ("coulomb", "viscous"), ("positive", "negative")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        half = torque_share(0.012, machine, joint)
        shape = {"level": float(rng.uniform(1.2, 3)), "slope": float(rng.uniform(1.2, 2))}
        return cls(joint, half, 8 * half, cls.draw_form(rng), shape)

    @property
    def equivalent(self) -> tuple[str, ...]:
        """Levels alone equal a mean level and an offset."""
        return ("coulomb_friction", "torque_offset") if self.form == "levels" else ()

    def parameters(self) -> ParameterValues:
        level = self.size * self.shape["level"]
        return {"positive": level + self.size, "negative": level - self.size}

    def torque(self, track: Track, run: int) -> Array:
        velocity = track.velocity[:, self.joint]
        direction = smooth_sign(velocity)
        torque = self.size * (self.shape["level"] * direction + np.abs(direction))
        if self.form == "levels":
            return np.asarray(torque)
        return np.asarray(torque + self.size * (self.shape["slope"] * velocity + np.abs(velocity)))


class Curve(HiddenEffect):
    """tau = F sgn(v) (b + (1 + tanh x) / 2), x = (|v| - w) / d: a step between two plateaus.

    Other form: tau = F sgn(v) (b + d log(1 + exp x) / w), a plateau and then a rise. No law of friction has these
    curves; both grow with speed. size: F, the height of the step, N m.
    """

    effect, forms = "friction_curve", ("step", "plateau and rise")
    companions = ("coulomb", "viscous")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        knee = float(rng.uniform(0.15, 0.4) * machine.speed[joint])
        shape = {"base": float(rng.uniform(0.3, 1.0)), "knee": knee, "width": float(rng.uniform(0.1, 0.25)) * knee}
        step = torque_share(0.03, machine, joint)
        return cls(joint, step, 8 * step, cls.draw_form(rng), shape)

    def torque(self, track: Track, run: int) -> Array:
        velocity = track.velocity[:, self.joint]
        knee, width = self.shape["knee"], self.shape["width"]
        beyond = (np.abs(velocity) - knee) / width
        rise = (1 + np.tanh(beyond)) / 2 if self.form == "step" else width / knee * np.logaddexp(0, beyond)
        return np.asarray(self.size * smooth_sign(velocity) * (self.shape["base"] + rise))


class LoadDependent(HiddenEffect):
    """tau = m |tau_load| sgn(v); other form: |tau_load| fades in above a knee. size: m."""

    effect, forms = "load_dependent_friction", ("share", "fading in")
    takes_energy = True
    units: ClassVar = {"coefficient": "1"}
    companions = ("coulomb", "viscous")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {"knee": torque_share(0.03, machine, joint), "width": float(rng.uniform(0.002, 0.01))}
        return cls(joint, 0.06, 0.35, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"coefficient": self.size}

    def torque(self, track: Track, run: int) -> Array:
        load, knee = track.load[:, self.joint], self.shape["knee"]
        felt = np.abs(load) if self.form == "share" else load**2 / np.sqrt(load**2 + knee**2)
        return np.asarray(self.size * felt * smooth_sign(track.velocity[:, self.joint], self.shape["width"]))


class Presliding(HiddenEffect):
    """Dahl's hysteresis, z' = v - |v| z / w, tau = F z / w; other forms: LuGre, Maxwell slip. size: F, N m.

    LuGre: the level rises at low speed (a Stribeck curve). Maxwell slip: three elements that slip one after another.
    """

    effect, forms = "presliding_hysteresis", ("dahl", "lugre", "maxwell slip")
    takes_energy = True
    units: ClassVar = {"level": "N.m", "stiffness": "N.m/rad"}
    companions, blurred = ("coulomb", "viscous"), ("level", "stiffness")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        shape = {"way": float(np.exp(rng.uniform(np.log(2e-3), np.log(3e-2)))), "rise": float(rng.uniform(0.2, 0.6))}
        level = torque_share(0.04, machine, joint)
        return cls(joint, level, 6 * level, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        return {"level": self.size, "stiffness": self.size / self.shape["way"]}

    def torque(self, track: Track, run: int) -> Array:
        steps = np.diff(track.position[:, self.joint], prepend=track.position[:1, self.joint])
        if self.form == "maxwell slip":
            return self.size * _maxwell_slip(steps, self.shape["way"])
        level = np.ones_like(steps)
        if self.form == "lugre":
            level += self.shape["rise"] * np.exp(-((track.velocity[:, self.joint] / 0.05) ** 2))
        kept = np.exp(-np.abs(steps) / (self.shape["way"] * level))
        return self.size * recursion(kept, np.sign(steps) * level * (1 - kept))


class Drift(HiddenEffect):
    """tau = D (f + exp(-t / T)) v: viscous friction that falls as the joint warms up.

    Other form: the heat of friction takes the place of time. Every run starts cold. size: D, N m s/rad.
    """

    effect, forms = "friction_drift", ("time", "heat")
    takes_energy = True
    units: ClassVar = {"initial": "N.m.s/rad", "final": "N.m.s/rad", "time_constant": "s"}
    companions, blurred = ("viscous", "coulomb"), ("initial", "final")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Time constants of seconds stand in for the minutes of real grease."""
        shape = {"final": float(rng.uniform(0.5, 2.0)), "time_constant": float(rng.uniform(30, 90))}
        fall = torque_share(0.02, machine, joint)
        return cls(joint, fall, 6 * fall, cls.draw_form(rng), shape)

    def parameters(self) -> ParameterValues:
        final = self.size * self.shape["final"]
        return {"initial": final + self.size, "final": final, "time_constant": self.shape["time_constant"]}

    def torque(self, track: Track, run: int) -> Array:
        velocity, constant = track.velocity[:, self.joint], self.shape["time_constant"]
        cold = np.exp(-np.maximum(track.time, 0) / constant)
        if self.form == "heat":
            cold = np.exp(-np.cumsum(velocity**2) / np.sum(velocity**2) * (track.time[-1] / constant))
        return np.asarray(self.size * (self.shape["final"] + cold) * velocity)


class EarlyFriction(HiddenEffect):
    """tau = F (sgn(v(t + L)) - sgn(v(t))): friction that turns before the joint does. size: F, N m.

    A joint that sticks does that. No case hides it by itself: the second engine and real joints have it.
    """

    effect, forms = "early_friction", ("lead",)
    takes_energy = True

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Leads L of 1 to 20 ms, s."""
        level = torque_share(0.03, machine, joint)
        lead = float(np.exp(rng.uniform(np.log(1e-3), np.log(2e-2))))
        return cls(joint, level, 7 * level, cls.draw_form(rng), {"lead": lead})

    def torque(self, track: Track, run: int) -> Array:
        sign = smooth_sign(track.velocity[:, self.joint])
        return np.asarray(self.size * (np.interp(track.time + self.shape["lead"], track.time, sign) - sign))


def recursion(kept: Array, added: Array) -> Array:
    """States of x[k] = kept[k] x[k-1] + added[k] from rest, (steps,)."""
    state, states = 0.0, []
    for share, step in zip(kept.tolist(), added.tolist(), strict=True):
        state = share * state + step
        states.append(state)
    return np.array(states)


def _maxwell_slip(steps: Array, way: float) -> Array:
    """Mean of elements that stick up to a way of their own and then slip; 1 when all slip."""
    total = np.zeros(len(steps))
    for most in (0.3 * way, way, 2.5 * way):
        state, states = 0.0, []
        for step in steps.tolist():
            state = min(max(state + step, -most), most)
            states.append(state)
        total += np.array(states) / most / 3
    return total


def bouc_wen(steps: Array, power: float = 1.5, beta: float = 0.7, gamma: float = 0.3) -> Array:
    """Normalised Bouc-Wen hysteresis of a path given by its steps, (steps,); it stays within one."""
    state, states = 0.0, []
    for step in steps.tolist():
        size = abs(state) ** power
        state += step - (beta * abs(step) * (1 if state > 0 else -1) + gamma * step) * size
        states.append(state)
    return np.array(states)
