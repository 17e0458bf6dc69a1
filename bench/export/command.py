"""What `armlab export` does: a recorded trajectory, checked at the controller's rate, into a file."""

from pathlib import Path
from typing import Any

from bench.best_known.command import point_of
from bench.best_known.config import build_excitation
from bench.best_known.record import Record, read_records
from bench.export.formats import FORMATS
from bench.export.sampled import Sampled, sampled
from bench.files import write_whole
from bench.trial import canonical
from problem.errors import InputError
from problem.registry import ProblemSettings, parse_problem
from problem.settings import nearest
from problem.yaml_input import read_yaml

RATE_HZ = 250.0
_JUDGEMENT = ("limits", "workspace", "coefficient_limit", "samples", "columns", "unit_columns", "criterion", "penalty")


def export(problem: Path, record: str, form: str, out: Path, records: Path, rate_hz: float = RATE_HZ) -> Sampled:
    """Write the trajectory of a record, in one of FORMATS, if it keeps the limits of `problem` at `rate_hz`.

    problem: a YAML file with settings as `problem.registry` reads them; its limits may differ from those of
    the record, its trajectory may not. Raises InputError, in one line, for every other case.
    """
    settings = parse_problem(read_yaml(problem), str(problem))
    found = _record(records, record)
    _check_same_trajectory(settings, found, problem, record)
    trajectory = sampled(build_excitation(settings, str(problem)), point_of(found), rate_hz, record)
    write_whole(out, FORMATS[form](trajectory))
    return trajectory


def _record(path: Path, name: str) -> Record:
    records = read_records(path)
    if name not in records:
        raise InputError(f"no record '{name}' in {path}: {nearest(name, list(records))}")
    return records[name]


def _check_same_trajectory(settings: ProblemSettings, record: Record, path: Path, name: str) -> None:
    own: dict[str, Any] = settings.model_dump(mode="json")
    for key in own.keys() | record.settings.keys():
        here, there = (canonical(given.get(key)) for given in (own, record.settings))
        if key not in _JUDGEMENT and here != there:
            raise InputError(f"{path}: '{key}' is {here}, the record '{name}' has {there}: another one")
