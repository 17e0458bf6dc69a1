"""Friction that remembers: presliding, and wear of heat."""

from typing import Self

import numpy as np

from concealed.arms import Machine
from concealed.effects.hidden import Hidden, Values, size_of
from concealed.track import Track
from recordings.run import Array


class Presliding(Hidden):
    """Dahl's hysteresis; other forms: LuGre with a Stribeck curve, Maxwell slip elements. size: level, N m."""

    effect, forms = "presliding_hysteresis", ("dahl", "lugre", "maxwell slip")
    companions, blurred = ("coulomb", "viscous"), ("level", "stiffness")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Friction that needs some milliradians to turn over."""
        shape = {"way": float(np.exp(rng.uniform(np.log(2e-3), np.log(3e-2)))), "rise": float(rng.uniform(0.2, 0.6))}
        level = size_of(0.04, machine, joint)
        return cls(joint, level, 6 * level, cls.drawn_form(rng), shape)

    def parameters(self) -> Values:
        """Level and the stiffness at a reversal."""
        return {"level": self.size, "stiffness": self.size / self.shape["way"]}

    def torque(self, track: Track, run: int) -> Array:
        """The state of the contact times its stiffness."""
        steps = np.diff(track.position[:, self.joint], prepend=track.position[:1, self.joint])
        if self.form == "maxwell slip":
            return self.size * _maxwell_slip(steps, self.shape["way"])
        level = np.ones_like(steps)
        if self.form == "lugre":
            level += self.shape["rise"] * np.exp(-((track.velocity[:, self.joint] / 0.05) ** 2))
        kept = np.exp(-np.abs(steps) / (self.shape["way"] * level))
        return self.size * recursion(kept, np.sign(steps) * level * (1 - kept))


class Drift(Hidden):
    """Viscous friction that falls as the joint warms: in time; other form: with the heat that it makes.

    size: initial less final coefficient, N m s/rad. Every run starts cold.
    """

    effect, forms = "friction_drift", ("time", "heat")
    companions, blurred = ("viscous", "coulomb"), ("initial", "final")

    @classmethod
    def draw(cls, rng: np.random.Generator, machine: Machine, joint: int) -> Self:
        """Grease that thins within seconds: a fast stand-in for what takes minutes."""
        shape = {"final": float(rng.uniform(0.5, 2.0)), "time_constant": float(rng.uniform(3, 8))}
        fall = size_of(0.02, machine, joint)
        return cls(joint, fall, 6 * fall, cls.drawn_form(rng), shape)

    def parameters(self) -> Values:
        """Both coefficients and the time constant."""
        final = self.size * self.shape["final"]
        return {"initial": final + self.size, "final": final, "time_constant": self.shape["time_constant"]}

    def torque(self, track: Track, run: int) -> Array:
        """Against the motion."""
        velocity, constant = track.velocity[:, self.joint], self.shape["time_constant"]
        cold = np.exp(-np.maximum(track.time, 0) / constant)
        if self.form == "heat":
            cold = np.exp(-np.cumsum(velocity**2) / np.sum(velocity**2) * (track.time[-1] / constant))
        return np.asarray(self.size * (self.shape["final"] + cold) * velocity)


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
