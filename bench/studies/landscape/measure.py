"""Measures the problems of the comparisons, each once: what was measured with the same code and settings is kept."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
from joblib import Parallel, delayed

from armlab.common.files import write_whole
from bench.errors import StoppedError
from bench.execute import canonical
from bench.fingerprint import module_fingerprint
from bench.run import ProgressBar
from bench.studies.best_known.records import build_excitation, record_key, records_by_problem
from bench.studies.best_known.search import record_point
from bench.studies.landscape import features
from bench.studies.landscape.basins import End
from bench.studies.landscape.features import Effort, Landscape, measure_landscape
from problem.presets import JointFourierSettings, PaperSettings
from problem.suite import definition_of


@dataclass(frozen=True)
class Work:
    """One problem to be measured. labels: its names in the comparisons, more than one where only the frame differs.

    settings: without the frame. record: the best known point, empty where there is none. key: of all that decides the
    result.
    """

    labels: tuple[str, ...]
    settings: PaperSettings | JointFourierSettings
    record: tuple[float, ...]
    key: str

    def measure(self, effort: Effort) -> dict[str, Any]:
        """The features and the ends, as they are kept."""
        problem = build_excitation(self.settings, self.labels[0])
        landscape, ends = measure_landscape(
            problem, self.labels[0], effort, np.array(self.record) if self.record else None
        )
        return {"landscape": asdict(landscape), "ends": [asdict(end) for end in ends]}


def list_work(labels: Sequence[str], effort: Effort, records: Path) -> list[Work]:
    """The problems behind the labels of suites; those that differ in their frame alone are one.

    records: file of the best known trajectories. Raises InputError for a label that is no problem of a suite.
    """
    known = records_by_problem(records)
    groups: dict[str, list[str]] = {}
    for label in labels:
        groups.setdefault(canonical(_without_frame(label).model_dump(mode="json")), []).append(label)
    found = []
    for names in groups.values():
        settings = _without_frame(names[0])
        record = known.get(record_key(settings))
        point = tuple(map(float, record_point(record))) if record else ()
        parts = [
            names[0],
            asdict(effort),
            point,
            module_fingerprint(features.__name__, settings),
            canonical(settings.model_dump(mode="json")),
        ]
        found.append(Work(tuple(names), settings, point, hashlib.sha256(json.dumps(parts).encode()).hexdigest()))
    return found


def _without_frame(label: str) -> PaperSettings | JointFourierSettings:
    return definition_of(label).model_copy(update={"frame_seed": None})


def measure_all(
    work: Sequence[Work], effort: Effort, store: Path, workers: int, bar: ProgressBar
) -> list[dict[str, Any]]:
    """What `Work.measure` returns of each, in their order; the missing ones are measured and kept one by one.

    store: folder with a file a problem. Raises StoppedError on Ctrl-C.
    """
    store.mkdir(parents=True, exist_ok=True)
    missing = [each for each in work if not _place(store, each).exists()]
    with bar(len(work), len(work) - len(missing)) as progress:
        try:
            results = Parallel(n_jobs=workers, return_as="generator")(delayed(each.measure)(effort) for each in missing)
            for each, result in zip(missing, results, strict=True):
                write_whole(_place(store, each), json.dumps(result))
                progress.update(1)
        except KeyboardInterrupt:
            raise StoppedError(f"stopped; what was measured is in {store}, the same command goes on") from None
    return [json.loads(_place(store, each).read_text(encoding="utf-8")) for each in work]


def _place(store: Path, work: Work) -> Path:
    return store / f"{work.key}.json"


def feature_table(work: Sequence[Work], results: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """One row a label: problem, landscape (the label under which it was measured), form, arm, joints, and features."""
    rows = [
        {
            "problem": label,
            "landscape": each.labels[0],
            **_kind(each.settings),
            **asdict(Landscape(**result["landscape"])),
        }
        for each, result in zip(work, results, strict=True)
        for label in each.labels
    ]
    return pd.DataFrame(rows)


def ends_table(work: Sequence[Work], results: Sequence[dict[str, Any]]) -> pd.DataFrame:
    """One row a descent: landscape, number, value, feasible, gradients."""
    return pd.DataFrame(list(_end_rows(work, results)))


def _end_rows(work: Sequence[Work], results: Sequence[dict[str, Any]]) -> Iterator[dict[str, object]]:
    for each, result in zip(work, results, strict=True):
        for number, content in enumerate(result["ends"]):
            end = End(**content)
            yield {
                "landscape": each.labels[0],
                "number": number,
                "value": end.value,
                "feasible": end.feasible,
                "gradients": end.gradients,
            }


def _kind(settings: PaperSettings | JointFourierSettings) -> dict[str, object]:
    form = "tool" if isinstance(settings, PaperSettings) else "rest" if settings.rest else "joint"
    joints = len(build_excitation(settings, settings.preset).arm)
    return {"form": form, "arm": settings.arm, "joints": joints, "harmonics": settings.harmonics}
