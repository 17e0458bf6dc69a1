"""Which problems get a record, and where their search begins: configs/best_known.yaml."""

from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from problem.errors import InputError
from problem.excitation_problem import ExcitationProblem
from problem.registry import ProblemSettings, parse_problem
from problem.settings import Settings, nearest
from problem.yaml_input import read_yaml, validate


class Plan(Settings):
    """Problems by name, as `problem.registry` reads them.

    start_from: problems whose starts are the record of another one and kicks of their own best, in turn.
    """

    name: str
    seed: Annotated[int, Field(ge=0)]
    problems: Annotated[dict[str, dict[str, Any]], Field(min_length=1)]
    start_from: dict[str, str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _starts_are_problems(self) -> Self:
        for name in (*self.start_from, *self.start_from.values()):
            if name not in self.problems:
                raise ValueError(f"start_from names no problem '{name}': {nearest(name, list(self.problems))}")
        return self

    def settings(self, name: str) -> ProblemSettings:
        """Settings of one problem; raises InputError, in one line, for an unknown name or a mistake in them."""
        if name not in self.problems:
            raise InputError(f"no problem '{name}': {nearest(name, list(self.problems))}")
        return parse_problem(self.problems[name], f"problem '{name}'")


def read_plan(path: Path) -> Plan:
    """The plan in a YAML file; raises InputError, in one line, for any mistake in it."""
    return validate(Plan, read_yaml(path), str(path))


def build_excitation(settings: ProblemSettings, name: str) -> ExcitationProblem:
    """The problem; raises InputError if it is no trajectory of an arm, or one in shifted coordinates."""
    problem = settings.build()
    if not isinstance(problem, ExcitationProblem):
        raise InputError(f"{name}: should be a trajectory of an arm in its own coordinates, not '{problem.name}'")
    return problem
