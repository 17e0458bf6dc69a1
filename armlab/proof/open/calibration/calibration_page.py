"""The files of a calibration: `calibration.json`, which the diagnosis reads, and `calibration.md` for people."""

import json
from collections.abc import Iterator, Sequence
from pathlib import Path

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.diagnosis.choice import Weights
from armlab.diagnosis.torque.names.decide import CALIBRATION_FILE
from armlab.proof.open.calibration.calibrate import Calibration, Reliability

CALIBRATION_SCHEMA = "calibration/2"
PAGE_FILE = "calibration.md"
DIGITS = 4


def write_calibration(
    found: Calibration, sources: Sequence[str], out: Path, before: Sequence[str] = ()
) -> tuple[Path, ...]:
    """Writes both files. sources: the sets from which the weights are; before: those of weights that were kept."""
    kept = f" Other weights are kept as they were learnt from these: {'; '.join(before)}." if before else ""
    content = {
        "schema": CALIBRATION_SCHEMA,
        "sets": [*before, *sources],
        "findings": found.findings,
        "spreads_times": found.narrower,
        "all": _rounded(found.weights),
        "left_out": {name: _rounded(each) for name, each in found.left_out.items()},
    }
    page = markdown_page(
        "Probabilities of names: calibration",
        f"From {found.findings} findings and candidates of these sets: {'; '.join(sources)}.{kept}",
        "## Reliability",
        "Likeliest answers beyond background, in cases that were left out in turn; of one real recording all together.",
        markdown_table(("tier", "probability", "answers", "mean probability", "right"), list(_rows(found))),
        markdown_table(("tier", "Brier score", "of the base rate", "log score", "of the base rate"), _scores(found)),
        "## Weights",
        f"Lapse: {100 * found.weights.lapse:.1f} % of findings. Spreads: {found.narrower:g} times the stated ones.",
        markdown_table(("what speaks for a name", "weight"), _weight_rows(found.weights)),
    )
    return write_texts({CALIBRATION_FILE: json.dumps(content, indent=1) + "\n", PAGE_FILE: page}, out)


def _rounded(weights: Weights) -> dict[str, object]:
    numbers = {key: round(value, DIGITS) for key, value in sorted(weights.numbers.items())}
    return {"lapse": round(weights.lapse, DIGITS), "weights": numbers}


def _weight_rows(weights: Weights) -> list[tuple[str, str]]:
    return [(key, f"{value:.2f}") for key, value in sorted(weights.numbers.items())]


def calibration_lines(found: Calibration) -> Iterator[str]:
    """The reliability, a line a bin, for the terminal."""
    for tier, chance, number, mean, right in _rows(found):
        yield f"{tier}, probability {chance}: {number} answers, mean {mean}, right {right}"


def _rows(found: Calibration) -> Iterator[tuple[str, ...]]:
    for tier, reliability in found.tiers.items():
        for each in reliability.bins:
            low, high = each.interval
            share = f"{100 * each.right / each.findings:.0f} % ({100 * low:.0f} to {100 * high:.0f})"
            yield tier, f"{each.low:g}-{each.high:g}", str(each.findings), f"{each.mean:.2f}", share


def _scores(found: Calibration) -> list[tuple[str, ...]]:
    def row(tier: str, own: Reliability) -> tuple[str, ...]:
        return (tier, *(f"{value:.3f}" for value in (*own.brier, *own.log)))

    return [row(tier, own) for tier, own in found.tiers.items()]
