"""A Python function of the user's own as a problem."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Self

import numpy as np
from pydantic import ConfigDict, field_serializer, field_validator, model_validator

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.settings import Settings
from problem.contract import Evaluation


def callable_name(function: Callable[..., Any]) -> str:
    """The name of a function, of a method, or of an object's class."""
    return str(getattr(function, "__name__", type(function).__name__))


@dataclass(frozen=True, eq=False)
class CallableProblem:
    """A function of one point (dimension,) that returns a number, on a box without other limits."""

    name: str
    function: Callable[[Array], Any]
    lower: Array
    upper: Array

    def evaluate(self, points: Array) -> Evaluation:
        """The function's values as fitness and value; InputError where one is no number."""
        values = np.array([self._value_at(point) for point in points])
        return Evaluation(values, values, np.zeros(len(points)))

    def try_once(self) -> None:
        """Evaluates the middle of the box; InputError where the value is none that can be compared."""
        value = self._value_at((self.lower + self.upper) / 2)
        if value < 0:
            raise InputError(
                f"function {self.name} is {value:g} in the middle of its box: add a constant, since statistics "
                "take the logarithm, which a value below 0 does not have"
            )

    def _value_at(self, point: Array) -> float:
        value = np.asarray(self.function(point.copy()))  # the function may write into its point
        if value.size != 1 or value.dtype.kind not in "biuf":
            found = " ".join(repr(value).split())
            raise InputError(f"function {self.name} should return a number for a point {point.shape}, not {found:.60}")
        return float(value.reshape(()))


class CallableSettings(Settings):
    """A function with its box. No file can hold it, and nothing tells whether its code is still the same.

    What is written of it tells the functions of one process apart, no more.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)

    preset: Callable[[Array], Any]
    lower: tuple[float, ...]
    upper: tuple[float, ...]

    @field_validator("lower", "upper", mode="before")
    @classmethod
    def _from_array(cls, value: Any) -> Any:
        return tuple(float(each) for each in value) if isinstance(value, np.ndarray | tuple | list | range) else value

    @model_validator(mode="after")
    def _is_box(self) -> Self:
        if len(self.lower) != len(self.upper) or any(a >= b for a, b in zip(self.lower, self.upper, strict=True)):
            raise ValueError("'lower' should have as many numbers as 'upper', each below its partner")
        return self

    @field_serializer("preset")
    def _as_text(self, function: Callable[[Array], Any]) -> str:
        return f"{callable_name(function)} at {id(function)}"

    def build(self) -> CallableProblem:
        """The problem."""
        return CallableProblem(callable_name(self.preset), self.preset, np.array(self.lower), np.array(self.upper))
