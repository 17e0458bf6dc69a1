"""How often 95 % intervals hold the truth: simulated experiments with noise of several colours on both sides.

Each experiment passes the whole chain of filters; `armlab proof coverage` writes what `measure_coverage` returns.
"""

from collections.abc import Generator
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import lfilter
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.effects.scene import Scene
from armlab.identification.components import usual_components
from armlab.identification.identifier import Identifier
from armlab.identification.model import Model
from armlab.identification.structure import Structure
from armlab.recordings.recording import Run
from problem.arm import Arm
from problem.motion import Motion
from problem.robot_file import load_arm

HARMONICS, BASE_HZ = 5, 0.1
TRUE_COEFFICIENTS = {"viscous_friction": 1.5, "coulomb_friction": 2.0, "rotor_inertia": 0.05, "torque_offset": 0.4}


@dataclass(frozen=True)
class SimulatedNoise:
    """torque: standard deviation, N m; colour: correlation of neighbouring samples; encoder: rad, white."""

    torque: float = 0.2
    colour: float = 0.9
    encoder: float = 2e-5


@dataclass(frozen=True, eq=False)
class CoverageExperiment:
    """An arm with a known model, and how it is recorded."""

    arm: Arm
    structure: Structure
    truth: Array
    noise: SimulatedNoise
    rate_hz: float = 250.0
    seconds: float = 20.0

    def check_intervals(self, seed: int) -> tuple[NDArray[np.bool_], Array]:
        """Whether each interval contains the truth, and its half width in its parameter's unit; both (columns,)."""
        run = self.run(np.random.default_rng(seed))
        model = Identifier(self.arm, self.structure.components).fit([run]).model_
        half = model.factor * self._errors(model)
        return np.abs(model.values - self.truth) <= half, half

    def _errors(self, model: Model) -> Array:
        if model.covariance is None:
            raise ValueError("a fitted model has a covariance")
        return np.sqrt(np.diag(model.covariance))

    def run(self, rng: np.random.Generator) -> Run:
        """A recorded motion of random harmonics."""
        time = np.arange(round(self.seconds * self.rate_hz)) / self.rate_hz
        motion = fourier_motion(time, len(self.arm), rng)
        zero = np.zeros(motion.position.shape)
        scene = Scene("experiment", time, motion, self.arm, np.zeros(10 * len(self.arm)), zero)
        clean = (self.structure.matrix(scene) @ self.truth).reshape(len(time), -1)
        shocks = rng.standard_normal(clean.shape) * self.noise.torque * np.sqrt(1 - self.noise.colour**2)
        torque = clean + lfilter([1.0], [1.0, -self.noise.colour], shocks, axis=0)
        position = motion.position + self.noise.encoder * rng.standard_normal(clean.shape)
        return Run("simulated.csv", "identify", time, position, torque)


def fourier_motion(time: Array, joints: int, rng: np.random.Generator) -> Motion:
    """A sum of harmonics with random amplitudes and exact derivatives."""
    omega = 2 * np.pi * BASE_HZ * np.arange(1, HARMONICS + 1)
    a, b = rng.normal(0, 0.35, (2, HARMONICS, joints))
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    position, velocity = sine @ a + cosine @ b, (cosine * omega) @ a - (sine * omega) @ b
    return Motion(position, velocity, -(sine * omega**2) @ a - (cosine * omega**2) @ b)


def three_joint_experiment(noise: SimulatedNoise) -> CoverageExperiment:
    """The built-in three-joint arm with friction, rotors and offsets."""
    arm = load_arm("irb120-arm")
    structure = Structure(arm, usual_components(arm)).separable()[0]
    own = [TRUE_COEFFICIENTS[part.effect] for part in structure.components]
    return CoverageExperiment(arm, structure, np.concatenate([structure.base.values(arm.parameters), own]), noise)


NOISE_KINDS = {
    "as an arm's": SimulatedNoise(),
    "slow torque noise": SimulatedNoise(0.2, 0.97, 2e-5),
    "coarse encoder": SimulatedNoise(0.2, 0.5, 1e-4),
}


def measure_coverage(experiments: int, seed: int) -> Generator[str, None, dict[str, Any]]:
    """Runs experiments with each kind of noise; yields a line for each kind, and returns the numbers."""
    rows = {}
    for number, (name, noise) in enumerate(NOISE_KINDS.items()):
        count = experiments // len(NOISE_KINDS) + (number < experiments % len(NOISE_KINDS))
        experiment = three_joint_experiment(noise)
        seeds = np.random.SeedSequence((seed, number)).generate_state(count)
        held = np.array([experiment.check_intervals(int(each))[0] for each in seeds])
        rows[name] = _coverage_row(held)
        yield f"{name}: {100 * rows[name]['coverage']:.1f} % of {held.size} intervals in {count} experiments"
    total = float(
        np.average([row["coverage"] for row in rows.values()], weights=[row["experiments"] for row in rows.values()])
    )
    yield f"all: {100 * total:.1f} % in {experiments} experiments"
    return {"seed": seed, "coverage": total, "kinds": rows}


def _coverage_row(held: np.ndarray) -> dict[str, float]:
    """Coverage over parameters and experiments; its error from the scatter between experiments."""
    each = held.mean(axis=1)
    half = float(norm.ppf(0.975) * each.std(ddof=1) / np.sqrt(len(each)))
    worst, best = float(held.mean(axis=0).min()), float(held.mean(axis=0).max())
    return {
        "experiments": len(held),
        "coverage": float(each.mean()),
        "half_width": half,
        "least_parameter": worst,
        "most_parameter": best,
    }
