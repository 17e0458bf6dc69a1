"""Effects that a model has beside its linear components: computed by plug-ins of the group `armlab.effects`."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from importlib.metadata import EntryPoint, entry_points
from typing import Any, Protocol, runtime_checkable

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.effects.scene import Scene
from problem.arm import Arm

ENTRY_POINT_GROUP = "armlab.effects"
Value = float | tuple[float, ...]


class BrokenEffectError(InputError):
    """An effect of a plug-in that cannot be used."""


class Law(Protocol):
    """What a plug-in computes.

    rows: joints, from 0, whose torque it changes. of_channel: whether it falsifies the torque of all others.
    """

    @property
    def rows(self) -> tuple[int, ...]: ...

    @property
    def of_channel(self) -> bool: ...

    def columns(self, scene: Scene) -> Array:
        """Torque for each coefficient at one: (samples, rows, coefficients), N m (N)."""
        ...


@runtime_checkable
class Effects(Protocol):
    """What stands behind an entry point: makes laws from the parameters of a file, or raises ValueError."""

    effect: str

    def from_parameters(
        self, arm: Arm, joints: tuple[int, ...], parameters: Mapping[str, Value], form: str = ""
    ) -> tuple[Law, Array]:
        """The law of these joints (from 1) and its coefficients."""
        ...


@dataclass(frozen=True, eq=False)
class Extra:
    """An effect with its numbers. told: what the file says of it: effect, joint, joints, form, parameters."""

    told: Mapping[str, Any]
    law: Law
    coefficients: Array

    def __str__(self) -> str:
        """Its parameters on a line."""
        where = "" if self.told["joint"] is None else f", joint {self.told['joint']}"
        numbers = (f"{name} = {each['value']} {each['unit']}" for name, each in self.told["parameters"].items())
        return f"{self.told['effect']}{where}: {', '.join(numbers)}"

    def torque(self, scene: Scene) -> Array:
        """What it adds, (samples, joints), N m (N)."""
        out = np.zeros(scene.torque.shape)
        out[:, list(self.law.rows)] = self.law.columns(scene) @ self.coefficients
        return out


def torque_with_extras(extras: Sequence[Extra], scene: Scene) -> Array:
    """Torque of a scene and of extras, (samples, joints); faults of the torque's channel act on all the others."""
    inside = scene.torque + sum((each.torque(scene) for each in extras if not each.law.of_channel), np.zeros(1))
    read = replace(scene, torque=inside)
    return np.asarray(inside + sum((each.torque(read) for each in extras if each.law.of_channel), np.zeros(1)))


def extra_from_file(arm: Arm, told: Mapping[str, Any], parameters: Mapping[str, Value]) -> Extra:
    """The extra that a file tells of; ValueError where no plug-in has the effect or it does not fit."""
    effect, joint = told["effect"], told["joint"]
    joints = tuple(told["joints"]) or (() if joint is None else (joint,))
    if any(not 1 <= each <= len(arm) for each in joints):
        raise ValueError(f"joints {list(joints)} should be from 1 to {len(arm)}")
    found = [each for _, each in registered_effects() if each.effect == effect]
    if not found:
        raise ValueError("no effect that a model can compute; it may be of a package that is not installed")
    return Extra(told, *found[0].from_parameters(arm, joints, parameters, told["form"]))


def registered_effects() -> list[tuple[str, Effects]]:
    """Where each effect of a plug-in stands, and the effect; BrokenEffectError, in one line, for a broken one.

    An entry point is an effect, a class of one that takes no arguments, or a tuple of effects.
    """
    entries = sorted(entry_points(group=ENTRY_POINT_GROUP), key=lambda entry: entry.name)
    return [(entry.value, effect) for entry in entries for effect in _load_effects(entry)]


def _load_effects(entry: EntryPoint) -> tuple[Effects, ...]:
    try:
        found = entry.load()
    except (ImportError, AttributeError, SyntaxError) as error:
        raise BrokenEffectError(f"effect {entry.name!r} ({entry.value}) cannot be imported: {error}") from error
    found = found() if isinstance(found, type) else found
    effects = found if isinstance(found, tuple) else (found,)
    if not all(isinstance(each, Effects) for each in effects):
        raise BrokenEffectError(f"effect {entry.name!r} ({entry.value}) is no effect: it needs `effect` and `restored`")
    return effects
