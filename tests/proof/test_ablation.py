"""The ablation beside the diagnosis: which cases are done, and the page."""

from pathlib import Path
from typing import Any

from armlab.proof.tiers.guards import AblationSettings, _is_done, _write_verdicts, render_page


def _verdicts(*names: str) -> dict[str, dict[str, Any]]:
    return {name: {"status": "none"} for name in names}


def test_a_case_without_the_verdict_of_a_change_is_not_done(tmp_path: Path) -> None:
    _write_verdicts(lambda _: _verdicts("all guards on", "noise.max_order=8"), Path("case"), tmp_path)
    assert _is_done("case", (), tmp_path)
    assert _is_done("case", ("noise.max_order=8",), tmp_path)
    assert not _is_done("case", ("noise.max_order=8", "noise.max_order=4"), tmp_path)
    assert not _is_done("other", (), tmp_path)


def test_a_change_is_one_more_row_of_the_page() -> None:
    measured = [{"id": "wrong_names", "value": 0.25, "number": 8}]
    found: dict[str, dict[str, Any]] = {
        name: {"mixed": {"clean": measured}} for name in ("all guards on", "heldout_gain", "noise.max_order=8")
    }
    page = render_page(AblationSettings(1950, 8, 0, ("noise.max_order=8",)), found)
    assert "| guard off, or number changed |" in page
    assert "| heldout gain | - | - | 0.25 of 8 |" in page
    assert "| `noise.max_order=8` | - | - | 0.25 of 8 |" in page
    assert "| guard off |" in render_page(AblationSettings(1950, 8, 0), found)
