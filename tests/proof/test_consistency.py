"""A verdict held against itself: made ones that contradict themselves, and those of recordings at hand."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import engine_cases as cases
import numpy as np
import pytest

from armlab.diagnosis.formats import FindingEntry, FitEntry, LeftEntry, StoryEntry, VerdictFile
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.torque.columns.design import DesignMatrix
from armlab.diagnosis.torque.diagnose import diagnose, prepare
from armlab.diagnosis.torque.predict.parts import cause_of, removal_of
from armlab.diagnosis.torque.search.fitted_model import fit_background
from armlab.effects.library import effect_named, library
from armlab.proof.open.real_folders.consistency import contradictions
from armlab.recordings.load import load_recording
from armlab.recordings.public import LOCAL_COPIES_VARIABLE, local_copies
from armlab.recordings.recording import Recording
from armlab.report.torque.torque_verdict import verdict_lines
from armlab.report.verdict_files import make_verdict

SMALL = ("friction-damper/tension-20-lb", "dfki-double-pendulum")  # recordings that are diagnosed in seconds
FOUR = ("stribeck_friction", "backlash", "torque_ripple", "torque_offset")
SUMMARY = "90 % of the error comes from viscous friction at joint 2. It is 2.31 N m at 0.4 rad/s."


def finding(effect: str, joint: int | None = 2, share: float = 0.9, **changes: Any) -> FindingEntry:
    facts: dict[str, Any] = {"heldout_rms_before": 2.0, "heldout_rms_after": 1.0, "share_of_gap": share, **changes}
    return FindingEntry(effect=effect, joint=joint, parameters={}, equation="", rivals=(), **facts)


def verdict(*findings: FindingEntry, summary: str = SUMMARY, shares: tuple[float, ...] = (0.9,)) -> VerdictFile:
    story = tuple(
        StoryEntry(cause="friction", joints=(2,), share_of_gap=share, findings=(at,)) for at, share in enumerate(shares)
    )
    fit = (FitEntry(joint=2, heldout_rms_before=2.0, heldout_rms_after=1.0, noise_floor=0.5, gap_closed=0.7),)
    left = (LeftEntry(joint=2, share_of_torque=0.1, rms=1.0, noise=0.5, depends_on=(), usual=True),)
    content: dict[str, Any] = {"status": "mismatch", "located": (), "unexplained": (), "fit": fit, "left": left}
    return VerdictFile(schema="verdict/1", summary=summary, story=story, findings=findings, **content)


def test_a_sound_verdict_contradicts_nothing() -> None:
    assert contradictions(verdict(finding("viscous_friction"))) == ()
    factor = f"Torque gain error at joint 2: factor 1.48 (1.44 to 1.52). {SUMMARY}"
    assert contradictions(verdict(finding("viscous_friction"), summary=factor)) == ()


@pytest.mark.parametrize(
    ("wrong", "expected"),
    [
        (verdict(finding("viscous_friction", heldout_rms_before=0.9)), "without viscous_friction@2 the error falls"),
        (verdict(finding("viscous_friction"), shares=(0.8,)), "findings of friction explain 0.900, the cause 0.800"),
        (verdict(finding("payload", share=0.7), finding("backlash", share=0.7), shares=(0.7, 0.7)), "more than all"),
        (verdict(finding("viscous_friction"), summary=f"{SUMMARY} {SUMMARY}"), "says a sentence twice"),
        (verdict(finding("viscous_friction"), summary=SUMMARY.replace("90", "60")), "tells 60 %"),
        (verdict(finding("viscous_friction"), summary=SUMMARY.replace("2.31 N m", "2.31")), "2.31 without a unit"),
        (verdict(finding("viscous_friction"), summary="word " * 71), "71 words"),
        (verdict(*[finding(each, share=0.3) for each in FOUR]), "4 findings at 2"),
    ],
)
def test_a_contradiction_is_found(wrong: VerdictFile, expected: str) -> None:
    assert any(expected in each for each in contradictions(wrong)), contradictions(wrong)


def test_what_is_taken_away_costs_what_a_fit_of_all_others_leaves() -> None:
    recording = cases.recording(lambda motion, time: 2.0 * np.sign(motion.velocity) + 3.0 * motion.velocity)
    design = prepare(recording, None, Settings(), lambda message: None)
    assert isinstance(design, DesignMatrix)
    model = fit_background(design, library(), 0, lambda message: None)
    groups = [each for each in model.state.groups if model.solver.groups[each].candidate.is_friction_of(2)]
    removal = removal_of(model, groups)
    rank = model.columns.base
    kept = [model.solver.groups[each].columns for each in model.state.groups if each not in groups]
    columns = np.concatenate([np.arange(rank), *kept])
    free = replace(model, state=replace(model.state, widths=None))
    expected = removal_of(free, groups)
    gram = model.moments.gram
    errors = []
    for own in (columns, np.concatenate([columns, *(model.solver.groups[each].columns for each in groups)])):
        values = np.zeros(model.moments.size)
        values[own] = np.linalg.lstsq(gram[np.ix_(own, own)], gram[own, -1])[0] / model.moments.lengths[own]
        residual = model.columns.target_at(1) - model.columns.torque_at(1, values)
        errors.append(float(np.sqrt(np.mean(residual[design.observed.rows_held_out(1)] ** 2))))
    assert expected.joint == 1
    assert expected.growth == pytest.approx(errors[0] / errors[1] - 1, rel=0.02)
    assert not removal.is_minor


def recording_at_hand(name: str) -> Recording:
    root = local_copies()
    if root is None or not (root / name / "recording.yaml").is_file():
        pytest.skip(f"{LOCAL_COPIES_VARIABLE} holds no {name}")
    return load_recording(root / name)


@pytest.mark.parametrize("name", SMALL)
def test_the_verdict_on_a_recording_at_hand_contradicts_nothing_and_fits_a_terminal(name: str) -> None:
    found = diagnose(recording_at_hand(name), as_read=True)
    assert contradictions(make_verdict(found)) == ()
    assert len(list(verdict_lines(found))) <= 30


def test_one_log_cut_in_two_has_the_causes_of_the_whole() -> None:
    recording = recording_at_hand(SMALL[0])
    (long,) = recording.with_role("identify")[:1]
    half = long.samples // 2
    first = replace(long.rows(slice(None, half)), file=f"first-{Path(long.file).name}")
    second = replace(long.rows(slice(half, None)), file=f"second-{Path(long.file).name}")
    others = tuple(each for each in recording.runs if each is not long)
    cut = replace(recording, runs=(first, second, *others))
    causes = [
        {cause_of(effect_named(claim.effect)) for claim in found.claims if not claim.minor}
        for found in (diagnose(each, as_read=True) for each in (recording, cut))
    ]
    assert causes[0] == causes[1]
