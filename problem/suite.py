"""Suites of named problems: a name like `suite-1/irb120-joint-h5-t10-origin` always means the same problem."""

import dataclasses
import operator
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Annotated

from pydantic import Field, field_validator

from armlab.common.errors import InputError
from armlab.common.settings import Settings, read_yaml, suggest_name, validate
from problem.excitation import ExcitationProblem, ShiftedProblem
from problem.presets import CriterionSettings, JointFourierSettings, PaperSettings, PenaltyOrRules, SearchSpace

SUITE_FOLDER = Path(__file__).parent / "suites"
Definition = Annotated[PaperSettings | JointFourierSettings, Field(discriminator="preset")]


class SuiteFile(Settings):
    """The problems of one suite by their names in it."""

    instances: dict[str, Definition]


class InstanceSettings(Settings):
    """A problem of a suite by its full name; only its criterion, its penalty and, in joint space, its search space can
    be chosen.

    criterion: what makes a motion good. penalty: of broken limits, or `feasibility_rules`. search_space: `coefficients`
    or `feasible`.
    """

    preset: str
    penalty: PenaltyOrRules | None = None
    search_space: SearchSpace | None = None
    criterion: CriterionSettings | None = Field(default=None, exclude_if=operator.not_)  # written ones stay the same

    @field_validator("preset")
    @classmethod
    def _known(cls, name: str) -> str:
        definition_of(name)
        return name

    def build(self) -> ExcitationProblem | ShiftedProblem:
        """The problem, under its full name."""
        definition = definition_of(self.preset)
        chosen = {name: value for name, value in dict(self).items() if name != "preset" and value is not None}
        if "search_space" in chosen and not isinstance(definition, JointFourierSettings):
            raise InputError(f"search_space: '{self.preset}' is no series in joint space, so it should be left out")
        problem = definition.model_copy(update=chosen).build()
        return dataclasses.replace(problem, name=self.preset)


def suites() -> list[str]:
    """Names of all suites."""
    return sorted(path.stem for path in SUITE_FOLDER.glob("*.yaml"))


def instances(suite: str) -> list[str]:
    """Full names of the problems of a suite, in its order. Raises InputError for an unknown suite."""
    return [f"{suite}/{name}" for name in _definitions(suite)]


def definition_of(name: str) -> PaperSettings | JointFourierSettings:
    """The settings behind a full name. Raises InputError, in one line, if there is no such problem."""
    suite, _, own_name = name.partition("/")
    definitions = _definitions(suite)
    if own_name not in definitions:
        raise InputError(f"suite '{suite}' has no problem '{own_name}': {suggest_name(own_name, list(definitions))}")
    return definitions[own_name]


@lru_cache
def _definitions(suite: str) -> Mapping[str, PaperSettings | JointFourierSettings]:
    if suite not in suites():
        raise InputError(f"unknown suite '{suite}': {suggest_name(suite, suites())}")
    path = SUITE_FOLDER / f"{suite}.yaml"
    return validate(SuiteFile, read_yaml(path), str(path)).instances
