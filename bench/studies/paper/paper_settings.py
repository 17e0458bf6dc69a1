"""Typed settings of the tables and figures that are no experiments, one YAML file each."""

from pathlib import Path
from typing import Annotated, Self, TypeVar

from annotated_types import Ge, Gt, Len
from pydantic import model_validator

from armlab.common.settings import Settings, read_yaml, validate

Positive = Annotated[float, Gt(0)]
NonNegative = Annotated[float, Ge(0)]
AnySettings = TypeVar("AnySettings", bound=Settings)


class Table1Settings(Settings):
    """The arm whose D-H parameters are shown."""

    name: str
    arm: str


class Table2Settings(Settings):
    """experiment: name of the configuration, beside this one, whose parameters are shown."""

    name: str
    experiment: str


class TrajectorySettings(Settings):
    """The best trajectory that an algorithm found in an experiment, drawn at so many instants."""

    name: str
    experiment: str
    algorithm: str
    samples: Annotated[int, Ge(2)]


class Figure4Settings(TrajectorySettings):
    """arm_at: instants, s, at which the arm itself is drawn."""

    arm_at: Annotated[tuple[NonNegative, ...], Len(min_length=1)]


class Table4Settings(Settings):
    """The simulated experiment on the best trajectory of an algorithm.

    encoder_counts: counts a turn of the joint. torque_noise: standard deviation, N m. cutoff_hz: of the zero-phase
    low-pass. decimation: every n-th sample is kept after the filter.
    """

    name: str
    experiment: str
    algorithm: str
    repetitions: Annotated[int, Ge(2)]
    seed: Annotated[int, Ge(0)]
    sample_rate_hz: Positive
    encoder_counts: Annotated[int, Ge(1)]
    torque_noise: Positive
    cutoff_hz: Positive
    decimation: Annotated[int, Ge(1)]

    @model_validator(mode="after")
    def _filter_below_nyquist(self) -> Self:
        if self.cutoff_hz >= self.sample_rate_hz / 2:
            raise ValueError("'cutoff_hz' should be below half of 'sample_rate_hz'")
        return self


def read_settings(model: type[AnySettings], path: Path) -> AnySettings:
    """The settings in a YAML file; raises InputError, in one line, for any mistake in it."""
    return validate(model, read_yaml(path), str(path))
