"""Table 4: the identified base parameters against the true ones, and what becomes of the paper's list of 22."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from bench.page import markdown_table, page
from bench.paper.best_run import BestRun
from bench.paper.identify import Identification
from bench.paper.settings import Table4Settings
from bench.printed import Printed
from bench.table import as_csv
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS
from problem.base_parameters import BaseParameters
from problem.transforms import Array

MILLIMETRES = {"kg": 1.0, "kg.m": 1e3, "kg.m2": 1e6}
_NOTE = """\
Least squares sees sums only: each row is a base parameter, the kept column with what regroups into it. `exact` is
identified without noise. With noise: {repetitions} repetitions of {duration:g} s at {rate:g} Hz, encoder of {counts}
counts a turn (quantised, its zero anywhere within a count; differentiated by central differences), white torque noise
of {noise:g} N m, zero-phase low-pass at {cutoff:g} Hz for both, one sample in {decimation} kept. `predicted` is the
standard deviation that least squares itself claims, averaged; a bias beyond it comes from the errors in the
observation matrix, which least squares knows nothing of."""
_LIST = """\
The paper's Table 4 lists 22 parameters one by one, in kg, kg mm, kg mm². `ours` says whether three joint torques
determine the parameter alone, only in a sum with others, or not at all; `least norm` is what least squares gives for
it when all 30 are asked for without noise, `true` what the simulation holds, about the link's frame (the paper's
inertias are about the centre of mass)."""


def table4(settings: Table4Settings, run: BestRun, found: Identification, paper: Printed) -> dict[str, str]:
    """The files of Table 4."""
    base, parameters = base_table(run.problem.base, found), listed_parameters(run, found, paper)
    note = _NOTE.format(
        repetitions=settings.repetitions,
        duration=run.problem.duration,
        rate=settings.sample_rate_hz,
        counts=settings.encoder_counts,
        noise=settings.torque_noise,
        cutoff=settings.cutoff_hz,
        decimation=settings.decimation,
    )
    text = page(settings.name, note, _shown(base), "## The paper's 22 parameters", _LIST, _shown(parameters))
    return {
        f"{settings.name}.csv": as_csv(base),
        f"{settings.name}_parameters.csv": as_csv(parameters),
        f"{settings.name}.md": text,
    }


def base_table(base: BaseParameters, found: Identification) -> pd.DataFrame:
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


def listed_parameters(run: BestRun, found: Identification, paper: Printed) -> pd.DataFrame:
    """One row a parameter of the paper's Table 4: kg, kg mm, kg mm2."""
    names, scale = run.problem.arm.parameter_names, _millimetres(len(run.problem.arm))
    by_name = {
        "true": dict(zip(names, run.problem.arm.parameters * scale, strict=True)),
        "least norm": dict(zip(names, found.individual * scale, strict=True)),
    }
    return pd.DataFrame(
        {
            "parameter": name,
            "ours": status(run.problem.base, name),
            "true": _tidy(by_name["true"], name),
            "least norm": _tidy(by_name["least norm"], name),
            "printed ideal": float(row.ideal),
            "printed identified": float(row.identified),
        }
        for name, row in paper.table4.items()
    )


def status(base: BaseParameters, name: str) -> str:
    """Whether torques determine a parameter alone, in a sum, or not at all."""
    if name in base.alone:
        return "alone"
    return "in a sum" if name in base.grouped else "no effect"


def _millimetres(joints: int) -> Array:
    return np.tile([MILLIMETRES[unit] for unit in PARAMETER_UNITS], joints)


def _tidy(values: Mapping[str, float], name: str) -> float:
    """The value with rounding noise removed: zero where it is below 1e-6 of the unit."""
    return round(values[name], 6) + 0.0


def _shown(table: pd.DataFrame) -> str:
    rows = [[f"{cell:.4g}" if isinstance(cell, float) else cell for cell in row] for row in table.to_numpy()]
    return markdown_table(list(table.columns), rows)
