"""How alike recordings are: features of made signals, what a classifier can tell, pictures without a hint."""

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from armlab.common.errors import DataError
from armlab.proof.open.likeness.classifier import LikenessArm, area_under_curve, separate
from armlab.proof.open.likeness.features import FEATURES, recording_features
from armlab.proof.open.likeness.likeness_page import FIGURE_FILE, PAGE_FILE, likeness_texts
from armlab.proof.open.likeness.look import compare, look_of, looks_text, read_looks
from armlab.proof.open.likeness.pictures import KEY_FILE, Pictured, draw_pictures
from armlab.proof.open.likeness.real_arms import RealFolder, arm_of, drawable_folders

ROBOT = {
    "name": "drive",
    "dh_convention": "standard",
    "gravity": [0.0, 0.0, -9.81],
    "joints": [{"name": "joint1", "type": "revolute", "a": 0.1, "d": 0.0, "alpha": 0.0}],
}


def _write_drive(folder: Path, rest: float, noise: float, held: int = 1, seconds: float = 20.0) -> Path:
    """A drive of 100 Hz with inertia, friction, a rest of 3 Hz and white noise, both over the torque without them."""
    folder.mkdir(parents=True)
    time = np.arange(0, seconds, 0.01)
    position = np.sin(1.3 * time) + 0.5 * np.sin(2.9 * time)
    velocity = 1.3 * np.cos(1.3 * time) + 1.45 * np.cos(2.9 * time)
    acceleration = -1.69 * np.sin(1.3 * time) - 4.205 * np.sin(2.9 * time)
    torque = acceleration + np.sign(velocity) + 0.5 * velocity
    size = np.std(torque)
    torque = torque + rest * size * np.sqrt(2) * np.sin(2 * np.pi * 1.7 * time)
    torque += noise * size * np.random.default_rng(0).standard_normal(len(time))
    table = pd.DataFrame({"t": time, "q": position, "tau": torque})
    table.loc[:, ["q", "tau"]] = table[["q", "tau"]].to_numpy()[np.arange(len(table)) // held * held]
    table.to_csv(folder / "run.csv", index=False)
    settings = {
        "schema": "recording/1",
        "robot": "robot.yaml",
        "columns": {"time": "t", "position": ["q"], "torque": ["tau"]},
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": [{"file": "run.csv"}],
    }
    (folder / "robot.yaml").write_text(yaml.safe_dump(ROBOT))
    (folder / "recording.yaml").write_text(yaml.safe_dump(settings))
    return folder


def _feature(folder: Path, name: str) -> float:
    return float(recording_features(folder).values[0, list(FEATURES).index(name)])


def test_the_share_that_is_left_is_that_of_the_rest(tmp_path: Path) -> None:
    little, much = (_write_drive(tmp_path / name, rest, 0.0) for name, rest in (("little", 0.1), ("much", 0.4)))
    assert 10 ** _feature(much, "left_share") == pytest.approx(0.37, abs=0.06)  # of a torque that has grown by it
    assert _feature(much, "left_share") > _feature(little, "left_share") + 0.3


def test_noise_above_the_band_is_that_of_white_noise(tmp_path: Path) -> None:
    quiet, loud = (_write_drive(tmp_path / name, 0.0, noise) for name, noise in (("quiet", 0.01), ("loud", 0.1)))
    more = 100 ** _feature(loud, "noise_above") - 100 ** _feature(quiet, "noise_above")  # of the power
    assert more == pytest.approx(0.1**2 - 0.01**2, rel=0.2)


def test_rate_and_duration_are_those_of_the_recording(tmp_path: Path) -> None:
    folder = _write_drive(tmp_path / "it", 0.1, 0.01)
    assert 10 ** _feature(folder, "rate") == pytest.approx(100, rel=1e-6)
    assert 10 ** _feature(folder, "duration") == pytest.approx(19.99, rel=1e-6)


def test_a_recording_that_is_too_short_has_no_features(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no run of 100 samples"):
        recording_features(_write_drive(tmp_path / "short", 0.1, 0.01, seconds=0.5))


def test_area_is_the_share_of_pairs_in_the_right_order() -> None:
    scores, real = np.array([0.9, 0.4, 0.5, 0.1]), np.array([True, True, False, False])
    assert area_under_curve(scores, real) == 0.75


@pytest.fixture(autouse=True)
def _small_forest(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("armlab.proof.open.likeness.classifier.TREES", 20)


def _arms(rng: np.random.Generator, number: int, real: bool, shift: float) -> list[LikenessArm]:
    rows = [rng.normal(size=(int(rng.integers(1, 8)), len(FEATURES))) for _ in range(number)]
    return [
        LikenessArm(f"{real}-{place}", real, each + shift * np.eye(len(FEATURES))[0]) for place, each in enumerate(rows)
    ]


def test_arms_of_one_kind_are_not_told_apart_and_others_are() -> None:
    rng = np.random.default_rng(0)
    same = separate([*_arms(rng, 10, True, 0.0), *_arms(rng, 20, False, 0.0)])
    other = separate([*_arms(rng, 10, True, 4.0), *_arms(rng, 20, False, 0.0)])
    assert 0.25 < same.area < 0.75
    assert same.low < 0.5 < same.high
    assert other.area > 0.95
    assert np.argmax(other.importance) == 0


def test_folders_of_one_arm_are_one_arm() -> None:
    assert {arm_of("lwr4-null"), arm_of("lwr4-friction")} == {"lwr4"}
    assert {arm_of("panda-marcocognetti"), arm_of("unisa-panda")} == {"panda"}
    assert arm_of("emps") == "emps"


def test_pictures_are_of_each_arm_once_before_any_twice_and_of_none_without_a_licence(tmp_path: Path) -> None:
    def folder(name: str, arm: str, licensed: bool = True) -> RealFolder:
        return RealFolder(_write_drive(tmp_path / name, 0.1, 0.02), arm, licensed, name)

    found = [folder("a1", "a"), folder("a2", "a"), folder("b", "b"), folder("c", "c", licensed=False)]
    assert [each.name for each in drawable_folders([*found, folder("d", "friction-damper")])] == ["a1", "b", "a2"]


def test_a_look_is_logged_and_its_page_names_what_tells_most(tmp_path: Path) -> None:
    rng = np.random.default_rng(1)
    likeness = compare([*_arms(rng, 4, True, 4.0), *_arms(rng, 8, False, 0.0), "one folder: too short"])
    look = look_of(likeness, "0123456789", "field", 1000)
    (tmp_path / "looks.json").write_text(looks_text([look]))
    assert read_looks(tmp_path) == [look]
    texts = likeness_texts({"field": likeness}, [look])
    assert "| 0123456 | field | 1000 | 8 |" in texts[PAGE_FILE]
    assert next(iter(FEATURES)) in texts[PAGE_FILE].split("## What tells most")[1].splitlines()[4]
    assert "one folder: too short" in texts[PAGE_FILE]
    assert texts[FIGURE_FILE].startswith("<?xml")


def test_pictures_tell_nothing_by_name_size_or_order(tmp_path: Path) -> None:
    found = [
        Pictured(_write_drive(tmp_path / f"{real}-{place}", 0.1, 0.02), f"{real}-{place}", real)
        for real in (True, False)
        for place in range(3)
    ]
    texts = draw_pictures(found, 3, 7)
    key = json.loads(texts[KEY_FILE])
    pictures = {name: content for name, content in texts.items() if name != KEY_FILE}
    assert sorted(pictures) == [f"pictures/picture-{place:02d}.png" for place in range(1, 7)]
    assert sorted(each["real"] for each in key.values()) == [False] * 3 + [True] * 3
    assert [each["real"] for each in key.values()] not in ([True] * 3 + [False] * 3, [False] * 3 + [True] * 3)
    assert {content[16:24] for content in pictures.values()} == {next(iter(pictures.values()))[16:24]}  # width, height
    assert not any(b"True" in content or b"tEXt" in content for content in pictures.values())
