"""Problems by the name of their preset."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

from problem.errors import InputError
from problem.functions import FUNCTIONS
from problem.presets import (
    FunctionSettings,
    JointFourierSettings,
    PaperSettings,
    RandomFrameSettings,
)
from problem.settings import nearest
from problem.suite import InstanceSettings, instances, suites
from problem.yaml_input import validate

ProblemSettings = PaperSettings | JointFourierSettings | FunctionSettings | InstanceSettings
PRESETS: Mapping[str, type[ProblemSettings]] = MappingProxyType(
    {
        "paper": PaperSettings,
        "joint-fourier": JointFourierSettings,
        "random-frame": RandomFrameSettings,
        **dict.fromkeys(FUNCTIONS, FunctionSettings),
        **{name: InstanceSettings for suite in suites() for name in instances(suite)},
    }
)


def names() -> list[str]:
    """Names of all presets; beside them stand the problems of suites (see `problem.suite`)."""
    return [name for name, settings in PRESETS.items() if settings is not InstanceSettings]


def parse_problem(data: Mapping[str, Any], where: str) -> ProblemSettings:
    """Checked settings of `{preset: NAME, ...}`; where: what the data is, for the reader of an error.

    Raises InputError, in one line, for an unknown preset or key, or a value of the wrong type.
    """
    preset = data.get("preset") if isinstance(data, Mapping) else None
    if not isinstance(preset, str):
        raise InputError(f"{where}: should hold `preset: NAME`, one of {', '.join(names())}")
    if preset not in PRESETS:
        raise InputError(f"{where}: unknown preset '{preset}': {_advice(preset)}")
    return validate(PRESETS[preset], dict(data), where)


def _advice(preset: str) -> str:
    """The name that was probably meant: of a suite's problems if it looks like one of them."""
    return nearest(preset, list(PRESETS) if "/" in preset else names())
