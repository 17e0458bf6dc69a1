"""Torque that waves with the joint angle: cogging, gear meshing, eccentric gears."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from diagnosis.effects.contract import Candidate, Family, Scene, Value
from diagnosis.effects.term import Term, moves, number, restored_by
from problem.arm import Arm
from recordings.run import Array

LOWEST = 4.0  # cycles a turn: slower waves are gravity and springs
HIGHEST = 400.0
ORDERS = 150  # of a plain grid
BINS = 8  # positions a cycle of the highest order, where a scan averages what is left
KEPT = 3  # peaks of a scan


@dataclass(frozen=True)
class TorqueRipple(Term):
    """amplitude sin(order q + phase); shape: the order, cycles a turn (rad/m)."""

    effect = "torque_ripple"
    names = ("order", "amplitude", "phase")

    def columns(self, scene: Scene) -> Array:
        """Sine and cosine."""
        angle = self.shape[0] * scene.motion.position[:, self.own]
        return self._stacked(np.sin(angle), np.cos(angle))

    def parameters(self, coefficients: Array) -> dict[str, Value]:
        """Order, amplitude and phase."""
        amplitude, phase = wave(coefficients)
        return {"order": self.shape[0], "amplitude": amplitude, "phase": phase}

    def unit(self, name: str) -> str:
        """Unit of a parameter: along a sliding joint there are no turns."""
        return "rad/m" if name == "order" and self.kind == "prismatic" else super().unit(name)

    def equation(self, coefficients: Array) -> str:
        """The law with its numbers."""
        amplitude, phase = wave(coefficients)
        sign = "-" if phase < 0 else "+"
        inner = f"{number(self.shape[0])} q_{self.joint} {sign} {number(abs(phase))}"
        return f"tau_{self.joint} += {number(amplitude)} sin({inner})"

    @classmethod
    def restored(cls, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Any]) -> tuple[Self, Array]:
        """The effect with order, amplitude and phase."""
        order = float(parameters["order"])
        ripple = cls.at(arm, joints[0], shape=(order,), bounds=((order - 1, order + 1),))
        return ripple, unwave(float(parameters["amplitude"]), float(parameters["phase"]))


def wave(coefficients: Array) -> tuple[float, float]:
    """Amplitude and phase of a sin + b cos."""
    return float(np.hypot(*coefficients)), float(np.arctan2(coefficients[1], coefficients[0]))


def unwave(amplitude: float, phase: float) -> Array:
    """Coefficients of amplitude sin(. + phase)."""
    return amplitude * np.array([np.cos(phase), np.sin(phase)])


@dataclass(frozen=True)
class RippleFamily(Family):
    """Orders that the motion can tell apart, up to where it passes them faster than the samples follow."""

    effect: str = "torque_ripple"

    def candidates(self, arm: Arm, scenes: Sequence[Scene]) -> list[list[Candidate]]:
        """At most ORDERS orders a joint, coarser where there would be more: use `scan` for all of them."""
        found: list[list[Candidate]] = []
        for joint in (joint for joint in range(1, len(arm) + 1) if moves(scenes, joint)):
            step, highest = resolution(scenes, joint)
            count = min(ORDERS, int((highest - LOWEST) / step) + 1)
            if count > 1:
                orders = np.linspace(LOWEST, highest, count).tolist()
                found.append([_at_order(arm, joint, order, max(step, orders[1] - orders[0])) for order in orders])
        return found

    def scan(self, arm: Arm, scenes: Sequence[Scene], residuals: Sequence[Array]) -> list[list[Candidate]]:
        """The highest peaks of a spectrum over position: what is left, averaged in narrow bins of position."""
        found: list[list[Candidate]] = []
        for joint in (joint for joint in range(1, len(arm) + 1) if moves(scenes, joint)):
            step, highest = resolution(scenes, joint)
            if highest > LOWEST + step:
                orders, power = _spectrum(scenes, residuals, joint, step / 2, highest)
                peaks = _peaks(power, 2)
                found.append(
                    [replace(_at_order(arm, joint, float(orders[peak]), step), looks=len(orders)) for peak in peaks]
                )
        return found

    def restored(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Candidate, Array]:
        """The ripple with order, amplitude and phase."""
        return restored_by((TorqueRipple,), arm, joints, parameters, form)


def resolution(scenes: Sequence[Scene], joint: int) -> tuple[float, float]:
    """Step between orders that the motion tells apart, and the highest that it can show."""
    travel = max(float(np.ptp(scene.motion.position[:, joint - 1])) for scene in scenes)
    # half of the time of the slowest run the joint is slower than this: there a wave has eight samples
    pace = min(float(np.median(np.abs(scene.motion.velocity[:, joint - 1])) * scene.step) for scene in scenes)
    return np.pi / travel, min(HIGHEST, 2 * np.pi / (8 * pace))


def _at_order(arm: Arm, joint: int, order: float, step: float) -> TorqueRipple:
    return TorqueRipple.at(arm, joint, shape=(order,), bounds=((max(order - step, LOWEST / 2), order + step),))


def _spectrum(
    scenes: Sequence[Scene], residuals: Sequence[Array], joint: int, step: float, highest: float
) -> tuple[Array, Array]:
    """Orders, and the power of what is left at each."""
    place = np.concatenate([scene.motion.position[:, joint - 1] for scene in scenes])
    left = np.concatenate([residual[:, joint - 1] for residual in residuals])
    known = np.isfinite(left)
    place, left = place[known], left[known] - left[known].mean()
    width = 2 * np.pi / (highest * BINS)
    count = int(np.ceil(2 * np.pi / (step * width)))
    bins = ((place - place.min()) / width).astype(int) % count
    spectrum = np.abs(np.fft.rfft(np.bincount(bins, left, count))) ** 2
    orders = 2 * np.pi / (count * width) * np.arange(len(spectrum), dtype=np.float64)
    chosen = (orders >= LOWEST) & (orders <= highest)
    return orders[chosen], spectrum[chosen]


def _peaks(power: Array, apart: int) -> list[int]:
    """The KEPT highest peaks, at least so many places apart."""
    peaks: list[int] = []
    for index in np.argsort(power)[::-1].tolist():
        if all(abs(index - other) > apart for other in peaks):
            peaks.append(index)
        if len(peaks) == KEPT:
            break
    return peaks


TORQUE_RIPPLE = RippleFamily()
