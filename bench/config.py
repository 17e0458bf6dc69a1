"""The configuration of an experiment: one YAML file.

Types, hyper-parameters and names of algorithms are checked; every mistake is reported in one line.
"""

from collections.abc import Mapping
from dataclasses import MISSING, fields, is_dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, Self, get_type_hints

from pydantic import AfterValidator, BeforeValidator, Field, create_model, model_validator

from algorithms.contract import AnyAlgorithm
from algorithms.registry import BrokenAlgorithmError, UnknownAlgorithmError, load
from armlab.common.errors import InputError
from armlab.common.settings import Settings, read_yaml, validate
from bench.executors.contract import ExecutorSettings
from problem.callables import callable_name
from problem.registry import instances, suites

NAME_PATTERN = "[A-Za-z0-9][A-Za-z0-9_-]{0,99}"  # of an experiment: part of the names of its files


def _to_tuple(value: Any) -> Any:
    return value if isinstance(value, tuple) else (value,)


def _expand_problems(value: Any) -> Any:
    """One problem or many; a suite stands for all its problems, also in `{suite: NAME, penalty: ...}`."""
    return tuple(problem for item in _to_tuple(value) for problem in _expand_suite(item))


def _expand_suite(item: Any) -> tuple[Any, ...]:
    if isinstance(item, str) and item in suites():
        return tuple(instances(item))
    if not isinstance(item, dict) or "suite" not in item:
        return (item,)
    name, mark = str(item["suite"]), item.get("label")
    others = {key: value for key, value in item.items() if key not in ("suite", "label")}
    marked = [f"{problem} {mark}" if mark else problem for problem in instances(name)]
    return tuple(
        {"preset": problem, "label": label, **others} for problem, label in zip(instances(name), marked, strict=True)
    )


def _to_choice(value: Any) -> Any:
    return {"name": value} if isinstance(value, str) else value


def _check_label(label: str) -> str:
    """A name that fits into a line of a table."""
    if not label.isprintable():
        raise ValueError("should be one line of printable characters")
    return label


Label = Annotated[str, AfterValidator(_check_label)]


class AlgorithmChoice(Settings):
    """An algorithm; a bare name stands for one with its defaults.

    name: its registered name (`armlab bench list`). label: its name in tables and figures. params: hyper-parameters
    that differ from its defaults.
    """

    name: str
    label: Label = ""
    params: dict[str, Any] = Field(default_factory=dict)


class ProblemChoice(Settings):
    """A problem; a bare name stands for a preset with its defaults.

    label: its name in tables and figures. settings: in a file these keys stand beside `label`: `preset` and the keys
    of that preset, as below.
    """

    label: Label
    settings: dict[str, Any]


def _split_label(value: Any) -> Any:
    """Separates the key `label` from the keys of the problem; a bare name, or a function, is a preset."""
    if isinstance(value, str) or callable(value):
        return _split_label({"preset": value})
    if not isinstance(value, dict):
        return value
    settings = {key: item for key, item in value.items() if key != "label"}
    preset = value.get("preset", "problem")
    return {"label": value.get("label", callable_name(preset) if callable(preset) else preset), "settings": settings}


PositiveInt = Annotated[int, Field(ge=1, le=10**9)]
OneOrMany = Annotated[tuple[PositiveInt, ...], BeforeValidator(_to_tuple), Field(min_length=1)]


class Experiment(Settings):
    """A comparison: every problem x algorithm x swarm size x budget x repetition.

    name: begins the names of the result files. problem: one or several, each a preset (`paper`), a suite (`suite-2`),
    or keys with `preset:`. algorithms: those compared, by name or with `params`. swarm_size: points of a population,
    one number or several. repetitions: runs of each algorithm on each problem, each with random numbers of its own.
    seed: from which the random numbers of all runs follow. bounds: what happens to a point outside of the box.
    iterations: budget of swarm_size * (iterations + 1) evaluations, the first population included. evaluations: the
    budget itself. derivative_price: evaluations that a point with its derivatives counts for; the dimension plus one,
    as by forward differences, if left out. output: the result files beside the table; a key with several values gives
    a figure against them without further ado. printed: show the paper's Table 3
    beside ours. executor: where the trials run; it changes no outcome. trial_timeout_s: a trial that takes longer
    is ended, s.
    """

    name: Annotated[str, Field(pattern=f"^{NAME_PATTERN}$")]
    problem: Annotated[
        tuple[Annotated[ProblemChoice, BeforeValidator(_split_label)], ...],
        BeforeValidator(_expand_problems),
        Field(min_length=1),
    ]
    algorithms: Annotated[tuple[Annotated[AlgorithmChoice, BeforeValidator(_to_choice)], ...], Field(min_length=1)]
    swarm_size: OneOrMany
    iterations: OneOrMany | None = None
    evaluations: OneOrMany | None = None
    repetitions: PositiveInt
    seed: Annotated[int, Field(ge=0)]
    bounds: Literal["clip", "reflect", "wrap"] = "clip"
    derivative_price: PositiveInt | None = None
    output: Literal["table", "convergence", "rivals"] = "table"
    printed: bool = False
    executor: ExecutorSettings | None = None
    trial_timeout_s: Annotated[float, Field(gt=0, le=10**9)] | None = None

    @model_validator(mode="after")
    def _one_budget(self) -> Self:
        if (self.iterations is None) == (self.evaluations is None):
            raise ValueError("should hold exactly one of 'iterations' and 'evaluations'")
        if min(self.evaluations or (max(self.swarm_size),)) < max(self.swarm_size):
            raise ValueError("'evaluations' should be enough for one population of 'swarm_size'")
        return self

    @model_validator(mode="after")
    def _nothing_twice(self) -> Self:
        lists: dict[str, list[str] | list[int]] = {
            "problem": ["".join(problem.label.split()) for problem in self.problem],  # blanks alone tell nobody apart
            "algorithms": ["".join((algorithm.label or algorithm.name).split()) for algorithm in self.algorithms],
            "swarm_size": list(self.swarm_size),
            "iterations": list(self.iterations or ()),
            "evaluations": list(self.evaluations or ()),
        }
        for key, entries in lists.items():
            if len(set(entries)) < len(entries):
                raise ValueError(f"'{key}' holds an entry twice: remove it or give each a 'label' of its own")
        return self

    @model_validator(mode="after")
    def _fits_output(self) -> Self:
        if self.output == "convergence" and len(self.swarm_size) * len(self.iterations or self.evaluations or ()) > 1:
            raise ValueError("output 'convergence' should have one 'swarm_size' and one budget")
        return self

    def budgets(self, swarm_size: int) -> tuple[int, ...]:
        """The budgets in evaluations for a swarm size."""
        if self.evaluations is not None:
            return self.evaluations
        return tuple(swarm_size * (iterations + 1) for iterations in self.iterations or ())


Configuration = Path | Mapping[str, Any]
"""A YAML file, or its keys."""


def place_of(configuration: Configuration) -> str:
    """What a configuration is for the reader of a message."""
    return str(configuration) if isinstance(configuration, Path) else "the configuration"


def read_experiment(configuration: Configuration) -> Experiment:
    """The experiment of a configuration; raises InputError, in one line, for any mistake in it."""
    content = read_yaml(configuration) if isinstance(configuration, Path) else dict(configuration)
    return validate(Experiment, content, place_of(configuration))


def parse_params(params_type: type[Any], data: dict[str, Any], where: str) -> Any:
    """A `Params` with the given values and its defaults for the others.

    Raises InputError, in one line, for a name it does not have, a wrong type, or a value it refuses.
    """
    hints = get_type_hints(params_type, include_extras=True)
    known: dict[str, Any] = {field.name: (hints[field.name], _field_default(field)) for field in fields(params_type)}
    model: type[Settings] = create_model(params_type.__name__, __base__=Settings, **known)
    checked = validate(model, data, where)
    try:
        return params_type(**dict(checked))
    except ValueError as error:
        raise InputError(f"{where}: {error}") from None


def _field_default(field: Any) -> Any:
    if field.default_factory is not MISSING:
        return Field(default_factory=field.default_factory)
    return ... if field.default is MISSING else field.default


ALGORITHM_PARTS = ("Params", "name", "init", "ask", "tell", "incumbent", "finished")


def find_algorithm(name: str, where: str) -> AnyAlgorithm:
    """The algorithm of that name; raises InputError, in one line, if there is none or it cannot be used."""
    try:
        algorithm = load(name)
    except (UnknownAlgorithmError, BrokenAlgorithmError) as error:
        raise InputError(f"{where}: {error}") from None
    lacking = [part for part in ALGORITHM_PARTS if not hasattr(algorithm, part)]
    if lacking or not is_dataclass(algorithm.Params):
        lack = f"no {lacking[0]}" if lacking else "no dataclass Params"
        raise InputError(f"{where}: algorithm '{name}' has {lack}: see algorithms/contract.py")
    return algorithm
