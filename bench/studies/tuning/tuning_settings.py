"""What is tuned, on what, and on what it is judged: one YAML file."""

from pathlib import Path
from typing import Annotated, Any, Self

from annotated_types import Ge
from pydantic import Field, model_validator

from armlab.common.settings import Settings, read_yaml, suggest_name, validate
from bench.config import Experiment
from bench.studies.best_known.records import record_key
from problem.registry import parse_problem

Count = Annotated[int, Ge(1)]
Label = Annotated[str, Field(min_length=1)]
Number = int | float


class ParameterRange(Settings):
    """Values of a hyper-parameter that are tried, both ends included; whole numbers where both ends are whole.

    log: spaced evenly in the logarithm.
    """

    low: Number
    high: Number
    log: bool = False

    @model_validator(mode="after")
    def _ordered(self) -> Self:
        if not self.low < self.high:
            raise ValueError(f"'low' should be below 'high', not {self.low} and {self.high}")
        return self

    @property
    def whole(self) -> bool:
        """Whether only whole numbers are tried."""
        return isinstance(self.low, int) and isinstance(self.high, int)


class ParameterSweep(Settings):
    """One hyper-parameter of one algorithm at these values, all others as published, on the judging problems."""

    algorithm: str
    parameter: str
    values: Annotated[tuple[Number, ...], Field(min_length=1)]


class TuningSettings(Settings):
    """The tuning of several algorithms with the same budget for each.

    train, judge: names of problems; no problem stands in both, in any frame. algorithms: ranges by hyper-parameter.
    configurations: tried for each algorithm, the published one included. swarm_size, evaluations: of a run.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9_-]*$")]
    train: Annotated[tuple[Label, ...], Field(min_length=1)]
    judge: Annotated[tuple[Label, ...], Field(min_length=1)]
    algorithms: Annotated[dict[str, dict[str, ParameterRange]], Field(min_length=1)]
    configurations: Annotated[int, Ge(2)]
    train_repetitions: Count
    judge_repetitions: Count
    swarm_size: Count
    evaluations: Count
    train_seed: Annotated[int, Ge(0)]
    judge_seed: Annotated[int, Ge(0)]
    sweep: ParameterSweep | None = None

    @model_validator(mode="after")
    def _nothing_judges_that_was_trained_on(self) -> Self:
        keys = {_problem_key(name): name for name in self.train}
        for name in self.judge:
            if _problem_key(name) in keys:
                raise ValueError(f"'judge' should hold no problem of 'train': '{name}' is '{keys[_problem_key(name)]}'")
        return self

    @model_validator(mode="after")
    def _sweep_is_of_an_algorithm_here(self) -> Self:
        if self.sweep is not None and self.sweep.algorithm not in self.algorithms:
            hint = suggest_name(self.sweep.algorithm, list(self.algorithms))
            raise ValueError(f"'sweep' names no algorithm '{self.sweep.algorithm}': {hint}")
        return self

    def experiment(self, algorithms: list[dict[str, Any]], judging: bool) -> Experiment:
        """The runs of algorithms, as a configuration writes them, on the training or the judging problems."""
        content = {
            "name": self.name,
            "problem": self.judge if judging else self.train,
            "algorithms": algorithms,
            "swarm_size": self.swarm_size,
            "evaluations": self.evaluations,
            "repetitions": self.judge_repetitions if judging else self.train_repetitions,
            "seed": self.judge_seed if judging else self.train_seed,
        }
        return validate(Experiment, content, f"tuning '{self.name}'")


def read_tuning(path: Path) -> TuningSettings:
    """The settings in a YAML file; raises InputError, in one line, for any mistake in it."""
    return validate(TuningSettings, read_yaml(path), str(path))


def _problem_key(name: str) -> str:
    return record_key(parse_problem({"preset": name}, f"problem '{name}'"))
