"""What a reading mistake has to explain, learnt on arms that are read rightly."""

import json
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import t as student

from armlab.common.errors import InputError
from armlab.proof.open.likeness.real_arms import RealFolder
from armlab.proof.open.real_folders.reading_bound import ArmVerdict, WrongReading, bound_of, write_bound
from armlab.recordings.reading.tuning import learnt


def wrong_reading(arm: str, evidence: float, licensed: bool = True) -> WrongReading:
    folder = RealFolder(Path(arm), arm, licensed, f"{arm}-1")
    return WrongReading(folder, "torque_sign@1", evidence, (1.0, 0.1), (1.0, 2.0))


def test_the_bound_is_the_prediction_limit_of_one_more_arm() -> None:
    """Draws of normal evidences: one more exceeds the bound of the others in a hundredth of them."""
    rng = np.random.default_rng(1)
    draws = rng.normal(size=(4000, 6))
    bounds = np.array([bound_of([wrong_reading(str(arm), float(v)) for arm, v in enumerate(row)]) for row in draws])
    assert np.mean(rng.normal(size=len(bounds)) > bounds) == pytest.approx(0.01, abs=0.005)


def test_arms_count_alike_whatever_the_number_of_their_recordings() -> None:
    once = [wrong_reading(arm, value) for arm, value in (("a", 0.1), ("b", 0.3), ("c", 0.2))]
    values = np.array([0.1, 0.3, 0.2])
    assert bound_of(once) == pytest.approx(0.2 + student.ppf(0.99, 2) * values.std(ddof=1) * np.sqrt(4 / 3), abs=1e-3)
    assert bound_of([*once, once[1], once[1]]) == bound_of(once)
    assert bound_of([*once, wrong_reading("b", 0.9)]) > bound_of(once)


def test_two_arms_make_no_bound() -> None:
    with pytest.raises(InputError, match="2 arms"):
        bound_of([wrong_reading("a", 0.1), wrong_reading("b", 0.2), wrong_reading("b", 0.3)])


def test_the_page_names_no_recording_without_a_licence(tmp_path: Path) -> None:
    readings = [wrong_reading("free", 0.1), wrong_reading("hidden", 0.3, licensed=False), wrong_reading("open", 0.2)]
    verdicts = [ArmVerdict(each.folder.arm, each.folder.licensed, each, 0.5, (), (), 11, ()) for each in readings]
    bound, page = write_bound(readings, verdicts, tmp_path)
    assert "hidden" not in page.read_text(encoding="utf-8")
    assert "free" in page.read_text(encoding="utf-8")
    content = json.loads(bound.read_text(encoding="utf-8"))
    assert content["bound"] == bound_of(readings)
    assert "hidden" not in json.dumps(content)


def test_the_bound_that_is_shipped_is_above_what_chance_explains() -> None:
    assert 0.1 < learnt("bound") < 1.0
