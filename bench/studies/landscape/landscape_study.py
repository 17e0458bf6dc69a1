"""`armlab bench landscape`: measures what is missing, correlates, and writes tables, figure and both pages."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from io import StringIO
from pathlib import Path

import pandas as pd
import yaml

from armlab.common.errors import InputError
from armlab.common.files import write_texts
from bench.run import ProgressBar
from bench.studies.best_known.records import RECORDS_FILE
from bench.studies.landscape.features import Effort
from bench.studies.landscape.figure import draw_landscape
from bench.studies.landscape.landscape_page import PICTURE_STEM, landscape_page
from bench.studies.landscape.measure import ends_table, feature_table, list_work, measure_all
from bench.studies.landscape.optimiser_choice import choice_page
from bench.studies.landscape.sampling import SamplingSettings
from bench.studies.landscape.sources import Sources, SummaryTable
from bench.studies.landscape.standing import correlation_table, standings
from bench.tables import as_csv

FEATURES_FILE, ENDS_FILE, SETTINGS_FILE = "landscape.csv", "landscape_ends.csv", "landscape.settings.yaml"
CORRELATIONS_FILE, PAGE_FILE, CHOICE_FILE = "landscape_correlations.csv", "landscape.md", "which-optimiser.md"


@dataclass(frozen=True)
class LandscapeOptions:
    """results: folder of the results that are read. out: folder to write into.

    store: folder that keeps what was measured. workers: processes. pages: take features, ends and settings
    from `out` and measure nothing.
    """

    results: Path
    out: Path
    store: Path
    workers: int
    pages: bool = False
    effort: Effort = field(default_factory=Effort)


def make_landscape(options: LandscapeOptions, bar: ProgressBar) -> Iterator[Path]:
    """Measure, compare and write; yields the written files.

    It can be stopped at any time: what was measured is kept, and the same command goes on from there. Raises
    InputError where results are missing, StoppedError.
    """
    suites = [SummaryTable.read(options.results / "suite", name) for name in ("suite", "suite_heldout")]
    measured = _read_texts(options.out) if options.pages else _measure(suites, options, bar)
    features, ends = (pd.read_csv(StringIO(measured[name])) for name in (FEATURES_FILE, ENDS_FILE))
    first, second = (standings(each.table) for each in suites)
    _check_problems(features, [*first.index, *second.index])
    correlations = correlation_table(features, first, second)
    texts: dict[str, str | bytes] = {
        **measured,
        CORRELATIONS_FILE: as_csv(correlations),
        CHOICE_FILE: choice_page(Sources.read(options.results, features, correlations)),
        PAGE_FILE: landscape_page(features, correlations, _parse_effort(measured[SETTINGS_FILE])),
        **{f"{PICTURE_STEM}.{suffix}": image for suffix, image in draw_landscape(features, correlations, ends).items()},
    }
    yield from write_texts(texts, options.out)


def _measure(suites: list[SummaryTable], options: LandscapeOptions, bar: ProgressBar) -> dict[str, str]:
    labels = list(dict.fromkeys(str(name) for suite in suites for name in suite.table["problem"]))
    work = list_work(labels, options.effort, options.results / RECORDS_FILE)
    results = measure_all(work, options.effort, options.store, options.workers, bar)
    return {
        FEATURES_FILE: as_csv(feature_table(work, results)),
        ENDS_FILE: as_csv(ends_table(work, results)),
        SETTINGS_FILE: yaml.safe_dump(asdict(options.effort), sort_keys=False),
    }


def _read_texts(out: Path) -> dict[str, str]:
    names = (FEATURES_FILE, ENDS_FILE, SETTINGS_FILE)
    for name in names:
        if not (out / name).is_file():
            raise InputError(f"{out / name}: there is no such file; `armlab bench landscape` without --pages makes it")
    return {name: (out / name).read_text(encoding="utf-8") for name in names}


def _parse_effort(text: str) -> Effort:
    content = yaml.safe_load(text)
    try:
        return Effort(SamplingSettings(**content.pop("sampling")), **content)
    except (AttributeError, KeyError, TypeError):
        raise InputError(f"{SETTINGS_FILE}: is not as `armlab bench landscape` writes it") from None


def _check_problems(features: pd.DataFrame, problems: list[str]) -> None:
    unknown = sorted(set(problems) - set(features["problem"]))
    if unknown:
        raise InputError(f"{FEATURES_FILE}: has no row of '{unknown[0]}'; leave out --pages to measure it")
