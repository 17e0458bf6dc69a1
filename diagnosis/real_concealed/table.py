"""`concealed.csv`: a row for everything that was sought."""

from collections.abc import Iterator, Sequence
from io import StringIO
from typing import Any

import pandas as pd

from diagnosis.real_concealed.judge import Judged, Verdict
from diagnosis.real_concealed.study import Study
from diagnosis.real_concealed.words import finding

COLUMNS = (
    "recording", "concealed", "way", "sought", "answer", "finding", "strength", "joint_shown", "error_handed_over",
    "error_reference", "error_named", "error_found", "recovered", "gap_closed", "numbers", "numbers_that_fit",
    "others",
)  # fmt: skip


def csv(studies: Sequence[Study]) -> str:
    """The table as text; errors are RMS in N m (N) at the joint shown."""
    rows = [row for found in studies for each in found.verdicts for row in _rows(found, each)]
    out = StringIO()
    pd.DataFrame(rows, columns=list(COLUMNS)).to_csv(out, index=False, float_format="%.4g", lineterminator="\n")
    return out.getvalue()


def _rows(found: Study, verdict: Verdict) -> Iterator[tuple[Any, ...]]:
    outcome, joint = verdict.outcome, verdict.shows - 1
    way = "withheld" if verdict.case.injected is None else "injected"
    for each in verdict.judged:
        yield (
            found.name, verdict.case.name, way, each.sought.label, each.answer,
            "" if each.said is None else finding(each.said), verdict.strength, verdict.shows, outcome.given[joint],
            found.control.given[joint], outcome.named[joint], outcome.found[joint], outcome.recovered, verdict.gap,
            _numbers(each), sum(bool(one.holds) for one in each.numbers),
            "; ".join(finding(one) for one in verdict.others),
        )  # fmt: skip


def _numbers(judged: Judged) -> str:
    return "; ".join(
        f"{one.effect} {one.size.name} {one.truth[0]:.4g} -> {one.size.value:.4g}"
        + ("" if one.size.interval is None else f" [{one.size.interval[0]:.4g} {one.size.interval[1]:.4g}]")
        for one in judged.numbers
    )
