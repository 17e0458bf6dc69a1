"""Tables 1, 2 and 4: the arm, the parameters of the algorithms and the identified parameters, against the printed
ones.
"""

import dataclasses
from collections.abc import Iterator, Mapping, Sequence

import numpy as np
import pandas as pd

from armlab.common.arrays import Array
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.settings import read_yaml, validate
from bench.plan import Entry
from bench.printed import Printed, PrintedJoint, display_name, times_pi
from bench.studies.paper.paper_settings import Table1Settings, Table2Settings, Table4Settings
from bench.studies.paper.simulated_identification import BestRun, SimulatedIdentification
from bench.tables import as_csv
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS
from problem.base_parameters import BaseParameters
from problem.robot_file import BUILT_IN_FOLDER, JointEntry, RobotFile

_LENGTH_COLUMNS = {"a_mm": "a (mm)", "d_mm": "d (mm)"}
_ANGLE_COLUMNS = {"alpha": "alpha (deg)", "lower": "lower range (deg)", "upper": "upper range (deg)"}
_TABLE1_NOTE = """\
`printed` stands only where it differs from ours. The lengths and twists are the paper's. Its ranges are in radians;
that of joint 1 is printed as ±11π/22, half of the robot's ±11π/12, and those of joints 5 and 6 differ from the data
sheet too, which is what the built-in arm follows. `theta_offset` puts the joint zeros where the robot has them; the
paper has no such column."""


def make_table1(settings: Table1Settings, paper: Printed) -> dict[str, str]:
    """The files of Table 1. Raises InputError for an arm that is not built in or has other joints."""
    path = BUILT_IN_FOLDER / f"{settings.arm}.yaml"
    joints = validate(RobotFile, read_yaml(path), str(path)).joints
    table = pd.DataFrame(_table1_rows(joints, paper))
    cells = [[f"{entry:g}" if isinstance(entry, float) else entry for entry in row] for row in table.to_numpy()]
    text = markdown_page(settings.name, markdown_table(list(table.columns), cells), _TABLE1_NOTE)
    return {f"{settings.name}.csv": as_csv(table), f"{settings.name}.md": text}


def table1_deviations(arm: str, paper: Printed) -> list[str]:
    """What differs from the printed table, like `joint 1, upper range (deg): 165, printed 90`."""
    path = BUILT_IN_FOLDER / f"{arm}.yaml"
    rows = _table1_rows(validate(RobotFile, read_yaml(path), str(path)).joints, paper)
    return [f"joint {r['joint']}, {r['quantity']}: {r['ours']:g}, printed {r['printed']}" for r in rows if r["printed"]]


def _table1_rows(joints: tuple[JointEntry, ...], paper: Printed) -> list[dict[str, object]]:
    pairs = zip(joints, paper.table1, strict=True)
    return [
        {"joint": number, "quantity": name, "ours": ours, "printed": "" if np.isclose(ours, theirs) else f"{theirs:g}"}
        for number, (joint, row) in enumerate(pairs, start=1)
        for name, ours, theirs in _joint_quantities(joint, row)
    ]


def _joint_quantities(joint: JointEntry, row: PrintedJoint) -> Iterator[tuple[str, float, float]]:
    lower, upper = joint.position_limits or (-np.inf, np.inf)
    ours = {"a_mm": joint.a * 1e3, "d_mm": joint.d * 1e3, "alpha": joint.alpha, "lower": lower, "upper": upper}
    for key, name in _LENGTH_COLUMNS.items():
        yield name, round(ours[key], 9), float(getattr(row, key))
    for key, name in _ANGLE_COLUMNS.items():
        yield name, _degrees(ours[key]), _degrees(times_pi(getattr(row, key)))


def _degrees(angle: float) -> float:
    return round(float(np.degrees(angle)), 6)


_TABLE2_NOTE = """\
`printed` is the value of Table 2, for MuPSO of the text; a dash stands where the paper is silent and the value is
ours or, for `b`, `attraction` and `attraction_length`, that of the algorithm's own paper. a of GWO and WOA falls to 0
in the number of iterations, from the printed first value."""


def make_table2(settings: Table2Settings, entries: Sequence[Entry], paper: Printed) -> dict[str, str]:
    """The files of Table 2."""
    table = pd.DataFrame(list(_table2_rows(entries, paper)), columns=["algorithm", "parameter", "in force", "printed"])
    text = markdown_page(settings.name, markdown_table(list(table.columns), table.to_numpy().tolist()), _TABLE2_NOTE)
    return {f"{settings.name}.csv": as_csv(table), f"{settings.name}.md": text}


def table2_differences(entries: Sequence[Entry], paper: Printed) -> list[str]:
    """Printed parameters that are not in force."""
    return [
        f"{algorithm} {name}: {ours}, printed {theirs}"
        for algorithm, name, ours, theirs in _table2_rows(entries, paper)
        if theirs not in ("-", ours)
    ]


def _table2_rows(entries: Sequence[Entry], paper: Printed) -> Iterator[tuple[str, str, str, str]]:
    for entry in {entry.algorithm: entry for entry in entries}.values():
        theirs = paper.table2.get(entry.trial.algorithm, {})
        for name, value in dataclasses.asdict(entry.trial.params).items():
            printed = f"{theirs[name]:g}" if name in theirs else "-"
            ours = value if isinstance(value, str) else f"{value:g}"
            yield display_name(entry.algorithm), name, ours, printed


MILLIMETRE_FACTORS = {"kg": 1.0, "kg.m": 1e3, "kg.m2": 1e6}
_TABLE4_NOTE = """\
Least squares sees sums only: each row is a base parameter, the kept column with what regroups into it. `exact` is
identified without noise. With noise: {repetitions} repetitions of {duration:g} s at {rate:g} Hz, encoder of {counts}
counts a turn (quantised, its zero anywhere within a count; differentiated by central differences), white torque noise
of {noise:g} N m, zero-phase low-pass at {cutoff:g} Hz for both, one sample in {decimation} kept. `predicted` is the
standard deviation that least squares itself claims, averaged; a bias beyond it comes from the errors in the
observation matrix, which least squares knows nothing of."""
_LISTED_NOTE = """\
The paper's Table 4 lists 22 parameters one by one, in kg, kg mm, kg mm². `ours` says whether three joint torques
determine the parameter alone, only in a sum with others, or not at all; `least norm` is what least squares gives for
it when all 30 are asked for without noise, `true` what the simulation holds, about the link's frame (the paper's
inertias are about the centre of mass)."""


def make_table4(
    settings: Table4Settings, run: BestRun, found: SimulatedIdentification, paper: Printed
) -> dict[str, str]:
    """The files of Table 4."""
    base, parameters = base_table(run.problem.base, found), listed_parameters(run, found, paper)
    note = _TABLE4_NOTE.format(
        repetitions=settings.repetitions,
        duration=run.problem.duration,
        rate=settings.sample_rate_hz,
        counts=settings.encoder_counts,
        noise=settings.torque_noise,
        cutoff=settings.cutoff_hz,
        decimation=settings.decimation,
    )
    text = markdown_page(
        settings.name,
        note,
        _format_table(base),
        "## The paper's 22 parameters",
        _LISTED_NOTE,
        _format_table(parameters),
    )
    return {
        f"{settings.name}.csv": as_csv(base),
        f"{settings.name}_parameters.csv": as_csv(parameters),
        f"{settings.name}.md": text,
    }


def base_table(base: BaseParameters, found: SimulatedIdentification) -> pd.DataFrame:
    """One row a base parameter, SI."""
    units = [PARAMETER_UNITS[column % len(PARAMETER_NAMES)] for column in base.columns]
    return pd.DataFrame(
        {
            "base parameter": base.sums,
            "unit": units,
            "true": found.true,
            "exact": found.exact,
            "relative error": found.relative_error,
            "mean with noise": found.estimates.mean(axis=0),
            "bias": found.bias,
            "standard deviation": found.spread,
            "predicted": found.predicted,
        }
    )


def listed_parameters(run: BestRun, found: SimulatedIdentification, paper: Printed) -> pd.DataFrame:
    """One row a parameter of the paper's Table 4: kg, kg mm, kg mm2."""
    names, scale = run.problem.arm.parameter_names, _millimetre_factors(len(run.problem.arm))
    by_name = {
        "true": dict(zip(names, run.problem.arm.parameters * scale, strict=True)),
        "least norm": dict(zip(names, found.individual * scale, strict=True)),
    }
    return pd.DataFrame(
        {
            "parameter": name,
            "ours": identifiability_status(run.problem.base, name),
            "true": _round_value(by_name["true"], name),
            "least norm": _round_value(by_name["least norm"], name),
            "printed ideal": float(row.ideal),
            "printed identified": float(row.identified),
        }
        for name, row in paper.table4.items()
    )


def identifiability_status(base: BaseParameters, name: str) -> str:
    """Whether torques determine a parameter alone, in a sum, or not at all."""
    if name in base.alone:
        return "alone"
    return "in a sum" if name in base.grouped else "no effect"


def _millimetre_factors(joints: int) -> Array:
    return np.tile([MILLIMETRE_FACTORS[unit] for unit in PARAMETER_UNITS], joints)


def _round_value(values: Mapping[str, float], name: str) -> float:
    """The value with rounding noise removed: zero where it is below 1e-6 of the unit."""
    return round(values[name], 6) + 0.0


def _format_table(table: pd.DataFrame) -> str:
    rows = [[f"{cell:.4g}" if isinstance(cell, float) else cell for cell in row] for row in table.to_numpy()]
    return markdown_table(list(table.columns), rows)
