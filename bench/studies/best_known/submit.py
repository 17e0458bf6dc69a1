"""`armlab bench submit`: a trajectory for the problem of a record, recomputed and verified at every instant."""

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field

from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from armlab.common.markdown import markdown_table
from armlab.common.settings import Settings, read_yaml, suggest_name, validate
from bench.studies.best_known.descent import check_supported, evaluate_point
from bench.studies.best_known.records import build_excitation, parse_record, read_records, record_key
from bench.studies.best_known.records_table import HEADINGS, least_determinants, record_cells
from bench.studies.best_known.verify import verify_motion


class Submission(Settings):
    """problem: the name of a record. coefficients: by name, as the record has them; rad/s and rad. by: whose it is.

    source: where it is described.
    """

    problem: str
    coefficients: dict[str, float]
    by: Annotated[str, Field(min_length=1)]
    source: str = ""


def judge_submission(path: Path, records: Path) -> ResultLines:
    """What a submission reaches, what it keeps at every instant, and its row for the table of records.

    Raises InputError, in one line, for a mistake in the file, a broken limit and parts that come too close.
    """
    submission, known = validate(Submission, read_yaml(path), str(path)), read_records(records)
    if submission.problem not in known:
        hint = suggest_name(submission.problem, list(known))
        raise InputError(f"{path}: no record '{submission.problem[:60]}' in {records}: {hint}")
    record = known[submission.problem]
    settings = parse_record(record, submission.problem, records)
    problem = build_excitation(settings, submission.problem)
    check_supported(problem, submission.problem)
    names = problem.trajectory.names
    if missing := [name for name in names if name not in submission.coefficients]:
        raise InputError(f"{path}: coefficients lacks {len(missing)} of {len(names)}, {missing[0]} the first")
    if unknown := [name for name in submission.coefficients if name not in names]:
        raise InputError(f"{path}: unknown coefficient '{unknown[0]}': {suggest_name(unknown[0], list(names))}")
    point = np.array([submission.coefficients[name] for name in names])
    verified = verify_motion(problem, point, str(path))
    end = evaluate_point(problem, point)
    if not end.feasible:
        raise InputError(f"{path}: breaks a limit at the samples, or a margin of {submission.problem} between parts")
    yield f"{submission.problem}: {end.value:.6g}, best known {record.value:.6g} ({end.value / record.value:.4g} times)"
    if verified.safety is not None:
        yield from verified.safety.lines()
    least = least_determinants(known, records).get(record_key(settings))
    cells = [*record_cells(submission.problem, problem, point, verified, least), submission.by]
    yield from markdown_table(HEADINGS, [cells]).splitlines()
    return {
        "problem": submission.problem,
        "value": end.value,
        "best_known": record.value,
        "source": submission.source,
        "limit_use": verified.limit_use,
        "safety": None if verified.safety is None else verified.safety.content(),
        "row": dict(zip(HEADINGS, cells, strict=True)),
    }
