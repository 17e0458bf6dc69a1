"""Friction that a joint reaches through play: the law, and a real device that has it."""

from pathlib import Path

import numpy as np
import pytest
from public_copies import needs_copies

from armlab.common.arrays import Array
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.effects.scene import scene_of
from armlab.effects.transmission import FrictionBehindPlay
from armlab.recordings.load import load_recording
from armlab.recordings.public import fetch_recording
from armlab.recordings.recording import Run
from problem.motion import Motion
from problem.robot_file import load_arm

ARM = load_arm("emps")
GAP, WAY = 0.004, 0.002  # m
LAW = FrictionBehindPlay.at(ARM, 1, shape=(GAP, WAY / GAP), bounds=((1e-4, 1e-1), (0.02, 1.0)))


def engaged(position: Array) -> Array:
    """Share of the level of both directions at each position of a slow motion, (samples,)."""
    time = 0.01 * np.arange(len(position))
    column, still = position[:, None], np.zeros((len(position), 1))
    motion = Motion(column, np.gradient(position, time)[:, None], still)
    return LAW.columns(scene_of(Run("a.csv", "identify", time, column, still), motion, ARM))[:, 0].sum(axis=1)


def test_after_a_reversal_friction_falls_within_the_way_waits_for_the_gap_and_comes_back() -> None:
    there = np.linspace(0, 0.05, 2001)
    position = np.concatenate([there, there[-2::-1]])
    share = engaged(position)[2001:]
    travelled = 0.05 - position[2001:]
    assert share[travelled < WAY / 10] == pytest.approx(1, abs=0.11)
    assert share[(travelled > WAY + 1e-4) & (travelled < WAY + GAP - 1e-4)] == pytest.approx(0, abs=1e-9)
    assert share[travelled > 2 * WAY + GAP + 1e-4] == pytest.approx(-1)


@pytest.mark.parametrize(
    "tension", [pytest.param(each, marks=needs_copies(f"friction-damper-{each}-lb")) for each in (25, 80)]
)
def test_the_play_of_a_damper_is_named_and_no_mass_is_negative(tension: int, tmp_path: Path) -> None:
    recording = load_recording(fetch_recording(f"friction-damper-{tension}-lb", tmp_path / "damper"))
    found = diagnose(recording)
    named = {each.effect for claim in found.claims for each in (claim, *claim.rivals)}
    assert "backlash" in named
    assert "inertial_parameter_error" not in named
