"""The files of a calibration: `calibration.json`, which the diagnosis reads, and `calibration.md` for people."""

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from armlab.common.files import write_texts
from armlab.common.markdown import markdown_page, markdown_table
from armlab.diagnosis.naming.calibrate import Calibration, Reliability, is_of_kind
from armlab.diagnosis.naming.choice import Numbers, Weights
from armlab.diagnosis.naming.decide import CALIBRATION_FILE

CALIBRATION_SCHEMA = "calibration/3"
PAGE_FILE, KIND_PAGE_FILE = "calibration.md", "calibration-{kind}.md"
DIGITS = 4


def write_calibration(found: Calibration, sources: Sequence[str], out: Path) -> tuple[Path, ...]:
    """Writes both files. sources: the sets from which the weights are."""
    from_sets = {"all": _sources(found, sources)}
    page = _page(
        found,
        "Probabilities of names: calibration",
        f"From {found.findings} findings and candidates of these sets: {'; '.join(sources)}.",
        found.weights.numbers,
    )
    return write_texts({CALIBRATION_FILE: _weights_text(found, from_sets), PAGE_FILE: page}, out)


def write_calibration_of_kind(
    found: Calibration, kind: str, sources: Sequence[str], known_from: Mapping[str, Any], out: Path
) -> tuple[Path, ...]:
    """Writes all weights, those of one kind of findings renewed, and a page about these.

    known_from: the sets from which the others are, as the file of weights has them.
    """
    from_sets = {**known_from, kind: _sources(found, sources)}
    page = _page(
        found,
        f"Probabilities of names: calibration of `{kind}`",
        f"The weights of this kind of findings alone, from {found.findings} findings of these sets: "
        f"{'; '.join(sources)}. All other weights and the lapse stay as they are in [calibration]({PAGE_FILE}).",
        {key: value for key, value in found.weights.numbers.items() if is_of_kind(key, kind)},
    )
    texts = {CALIBRATION_FILE: _weights_text(found, from_sets), KIND_PAGE_FILE.format(kind=kind): page}
    return write_texts(texts, out)


def _sources(found: Calibration, sources: Sequence[str]) -> dict[str, Any]:
    return {"sets": list(sources), "findings": found.findings, "spreads_times": found.narrower}


def _weights_text(found: Calibration, from_sets: Mapping[str, Any]) -> str:
    content = {
        "schema": CALIBRATION_SCHEMA,
        "from": from_sets,
        "all": _rounded(found.weights),
        "left_out": {name: _rounded(each) for name, each in found.left_out.items()},
    }
    return json.dumps(content, indent=1) + "\n"


def _page(found: Calibration, title: str, about: str, numbers: Numbers) -> str:
    return markdown_page(
        title,
        about,
        "## Reliability",
        "Likeliest answers beyond background, in cases that were left out in turn; of one real recording all together.",
        markdown_table(("tier", "probability", "answers", "mean probability", "right"), list(_rows(found))),
        markdown_table(("tier", "Brier score", "of the base rate", "log score", "of the base rate"), _scores(found)),
        "## Weights",
        f"Lapse: {100 * found.weights.lapse:.1f} % of findings. Spreads: {found.narrower:g} times the stated ones.",
        markdown_table(("what speaks for a name", "weight"), _weight_rows(numbers)),
    )


def _rounded(weights: Weights) -> dict[str, object]:
    numbers = {key: round(value, DIGITS) for key, value in sorted(weights.numbers.items())}
    return {"lapse": round(weights.lapse, DIGITS), "weights": numbers}


def _weight_rows(numbers: Numbers) -> list[tuple[str, str]]:
    return [(key, f"{value:.2f}") for key, value in sorted(numbers.items())]


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
