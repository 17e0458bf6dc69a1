"""First recordings that tell too little: short, slow, few frequencies, small swings."""

import numpy as np

from concealed.arms import Machine
from concealed.motions import USED_RANGE
from concealed.plan import RunPlan
from recordings.run import Array

LENGTH_S = 8.0
RUNS = (RunPlan("poor", LENGTH_S, "identify"), RunPlan("poor", LENGTH_S, "validate"))
FREQUENCY_HZ = (0.2, 0.45)
SWING = (0.15, 0.4)  # of the range
VIGOUR = (0.2, 0.6)  # of the speed and the acceleration that the arm is used with


def poor_reference(rng: np.random.Generator, time: Array, machine: Machine) -> Array:
    """One sine a joint about a place of its own, nearly at one frequency for all, (steps, joints), rad."""
    low, high = machine.range
    middle, reach = (low + high) / 2, USED_RANGE * np.minimum((high - low) / 2, 2.0)
    pulse = 2 * np.pi * rng.uniform(*FREQUENCY_HZ) * rng.uniform(0.9, 1.1, machine.joints)
    allowed = np.minimum(machine.speed / pulse, machine.acceleration / pulse**2)
    swing = np.minimum(rng.uniform(*SWING, machine.joints) * reach, rng.uniform(*VIGOUR, machine.joints) * allowed)
    place = middle + rng.uniform(-0.6, 0.6, machine.joints) * (reach - swing)
    return np.asarray(place + swing * np.sin(np.outer(time, pulse) + rng.uniform(0, 2 * np.pi, machine.joints)))
