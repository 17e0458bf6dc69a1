"""`armlab bench export`: the trajectory of a record, checked at the controller's rate, as a file."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from armlab.common.errors import InputError
from armlab.common.files import refuse_inputs, write_whole
from armlab.common.settings import read_yaml, suggest_name
from bench.execute import canonical
from bench.studies.best_known.records import Record, build_excitation, read_records
from bench.studies.best_known.search import record_point
from bench.trajectory_files import TRAJECTORY_FORMATS, SampledTrajectory, sample_trajectory
from problem.registry import ProblemSettings, parse_problem
from problem.safe_motion import RecordedPlace, SafetySettings, safety_rules
from problem.safety_proof import SafetyReport, check_motion

DEFAULT_RATE_HZ = 250.0
_KEYS_THAT_MAY_DIFFER = (
    "limits",
    "workspace",
    "coefficient_limit",
    "samples",
    "columns",
    "unit_columns",
    "friction_columns",
    "criterion",
    "penalty",
)


@dataclass(frozen=True, eq=False)
class ExportedRecord:
    """The trajectory of a record at the controller's rate, and what was checked of it beside its limits."""

    trajectory: SampledTrajectory
    safety: SafetyReport


def export_record(
    problem: Path,
    record: str,
    form: str,
    out: Path,
    records: Path,
    rate_hz: float = DEFAULT_RATE_HZ,
    safety: SafetySettings | None = None,
    recorded: RecordedPlace | None = None,
) -> ExportedRecord:
    """Write the trajectory of a record, in one of FORMATS, if it keeps the limits of `problem` and the safety rules.

    problem: a YAML file with settings as `problem.registry` reads them; its limits may differ from those of
    the record, its trajectory may not. recorded: where the motion has to stay, unless `safety` says it. Raises
    InputError, in one line, for every other case.
    """
    refuse_inputs((problem, records), (out,), "the trajectory")
    settings = parse_problem(read_yaml(problem), str(problem))
    found = _find_record(records, record)
    _check_same_trajectory(settings, found, problem, record)
    built, point = build_excitation(settings, str(problem)), record_point(found)
    trajectory = sample_trajectory(built, point, rate_hz, record)
    robot = str(found.settings.get("arm", built.arm.name))  # a suite has built-in arms alone
    rules = safety_rules(built.arm, robot, built.constraints.limits, safety or SafetySettings(), recorded)
    report = check_motion(rules, built.trajectory, point, built.duration)
    write_whole(out, TRAJECTORY_FORMATS[form](trajectory))
    return ExportedRecord(trajectory, report)


def _find_record(path: Path, name: str) -> Record:
    records = read_records(path)
    if name not in records:
        raise InputError(f"no record '{name}' in {path}: {suggest_name(name, list(records))}")
    return records[name]


def _check_same_trajectory(settings: ProblemSettings, record: Record, path: Path, name: str) -> None:
    own: dict[str, Any] = settings.model_dump(mode="json")
    for key in sorted(own.keys() | record.settings.keys()):
        here = canonical(own.get(key))
        there = canonical(record.settings.get(key))
        if key not in _KEYS_THAT_MAY_DIFFER and here != there:
            raise InputError(f"{path}: '{key}' is {here}, the record '{name}' has {there}: it is of another trajectory")
