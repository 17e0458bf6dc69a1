"""Results in parts, joined by their keys: run stores of several machines, or folders of tidy tables."""

import json
from collections.abc import Iterable, Mapping, Sequence
from functools import reduce
from pathlib import Path
from typing import Any

import pandas as pd
import yaml

from armlab.common.documents import ResultLines
from armlab.common.errors import InputError
from bench.result_sets.formats import read_tidy, write_tidy
from bench.result_sets.result_set import TRIAL_COLUMNS, ResultSet, TableOfCurves
from bench.store import copy_outcomes, open_store, store_origins

VERSIONS = ("armlab", "python", "numpy", "scipy", "cmaes", "blas", "blas_kernels", "simd")
"""Facts of the provenance that decide numbers; armlab's own code is in the keys, and its commit may differ."""


def join_parts(parts: Sequence[Path], out: Path, any_versions: bool) -> ResultLines:
    """Join run stores into a new store, or folders of tidy tables into a new folder; tells what came from where.

    any_versions: join what was computed with different versions or on different kinds of processor. Raises InputError,
    in one line, for parts that do not fit together, and if `out` exists.
    """
    if out.exists():
        raise InputError(f"{out} exists already: name a new one with --out")
    folders = [part.is_dir() for part in parts]
    if any(folders) != all(folders):
        raise InputError("the parts should be run stores alone, or folders of tidy tables alone")
    return (yield from (_join_folders if all(folders) else _join_stores)(parts, out, any_versions))


def _join_stores(parts: Sequence[Path], out: Path, any_versions: bool) -> ResultLines:
    for part in parts:
        if not part.is_file():
            raise InputError(f"there is no run store {part}")
    origins = {part: [json.loads(facts) for facts in store_origins(part)] for part in parts}
    _check_versions(origins, any_versions)
    try:
        with open_store(out) as store:
            counts = [copy_outcomes(part, store) for part in parts]
            count = len(store.keys(""))
    except InputError:
        out.unlink(missing_ok=True)
        raise
    for part, new in zip(parts, counts, strict=True):
        yield f"{new} outcomes of {part} are new"
    yield f"{count} outcomes are in {out}"
    return {"outcomes": count, "files": [out]}


def _join_folders(parts: Sequence[Path], out: Path, any_versions: bool) -> ResultLines:
    sets = {part: read_tidy(part) for part in parts}
    _check_versions({part: list(each.origins) for part, each in sets.items()}, any_versions)
    joined = reduce(join_sets, sets.values())
    written = write_tidy(joined, out, "csv")
    yield f"{len(joined.trials)} trials of {len(parts)} folders are in {out}"
    return {"trials": len(joined.trials), "files": written}


def join_sets(first: ResultSet, second: ResultSet) -> ResultSet:
    """Both sets as one, the order of the first before that of the second; a trial that both have counts once, and one
    that failed in one part and was finished in the other is finished.

    Raises InputError where the seeds differ, where a label stands for different settings, and where a trial has another
    end in each.
    """
    ours, theirs = yaml.safe_load(first.settings), yaml.safe_load(second.settings)
    if ours["seed"] != theirs["seed"]:
        raise InputError(f"seeds {ours['seed']} and {theirs['seed']}: only runs of one seed are paired")
    merged = ours | {key: _merge(ours[key], theirs[key], key) for key in ("problem", "algorithms")}
    trials = pd.concat([first.trials, second.trials], ignore_index=True)
    keys = pd.MultiIndex.from_frame(trials[TRIAL_COLUMNS])
    failed = trials["failure"] != ""
    trials = trials[~(failed & keys.isin(keys[~failed]))]
    repeated = trials[trials.duplicated(TRIAL_COLUMNS, keep=False)]
    differing = repeated.drop_duplicates([*TRIAL_COLUMNS, "value", "violation"]).duplicated(TRIAL_COLUMNS)
    if differing.any():
        row = repeated.drop_duplicates([*TRIAL_COLUMNS, "value", "violation"])[differing].iloc[0]
        raise InputError(f"{', '.join(str(row[name]) for name in TRIAL_COLUMNS)} has another end in each part")
    curves = [curve for each in (first, second) for _, _, curve in each.cells()]
    return ResultSet(
        first.name,
        str(yaml.safe_dump(merged, sort_keys=False, allow_unicode=True)),
        tuple({json.dumps(origin, sort_keys=True): origin for origin in first.origins + second.origins}.values()),
        trials.drop_duplicates(TRIAL_COLUMNS, ignore_index=True),
        TableOfCurves(pd.concat(curves).drop_duplicates([*TRIAL_COLUMNS, "evaluations"], ignore_index=True)),
    )


def _merge(ours: Mapping[str, Any], theirs: Mapping[str, Any], key: str) -> dict[str, Any]:
    for label in ours.keys() & theirs.keys():
        if ours[label] != theirs[label]:
            raise InputError(f"'{label}' in '{key}' has other settings in each part: give each a 'label' of its own")
    return {**ours, **theirs}


def _check_versions(origins: Mapping[Path, Iterable[Mapping[str, Any]]], any_versions: bool) -> None:
    """Raises InputError where a fact that decides numbers differs between parts, unless that is wanted."""
    for fact in () if any_versions else VERSIONS:
        seen = {str(origin.get(fact)): part for part, found in origins.items() for origin in found}
        if len(seen) > 1:
            (one, here), (other, there), *_ = seen.items()
            raise InputError(
                f"{fact} is '{one}' in {here} and '{other}' in {there}: run both alike, or join them all the same with "
                "--any-versions"
            )
