"""The card of a planned motion: known identities, what a refit hides, and sizes that shrink with time."""

import csv
import io
import json
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from numpy.testing import assert_allclose
from refusals import refusal
from small_recordings import ARM, frame, motion_at, recording_in

from armlab.cli.main import main
from armlab.diagnosis.next.confusability import (
    Card,
    CardEntry,
    PlannedMotion,
    confusability_card,
    read_planned_motions,
)
from armlab.effects.library import library
from armlab.report.confusability.confusability_report import card_content, card_csv, card_lines, card_markdown

RECORDS = Path(__file__).parents[2] / "results" / "best_known.json"


def planned(seconds: float = 10.0, seed: int = 0) -> PlannedMotion:
    time = np.arange(round(seconds * 200)) / 200
    return PlannedMotion("motion", time, motion_at(time, seed))


@pytest.fixture(scope="module")
def card() -> Card:
    return confusability_card(ARM, (planned(),), library())


def entry(card: Card, effect: str, joint: int | None = None, form: str = "") -> CardEntry:
    return next(each for each in card.entries if (each.effect, each.joint) == (effect, joint) and form in each.form)


def rivals(card: Card, one: CardEntry, view: str) -> set[tuple[str, int | None]]:
    return {(card.entries[each.index].effect, card.entries[each.index].joint) for each in one.rivals[view]}


def test_a_linear_spring_and_a_cable_are_one_class_that_no_amount_of_data_tells_apart(card: Card) -> None:
    cable = entry(card, "cable_stiffness", 2, "linear")
    assert ("gravity_compensator", 2) in rivals(card, cable, "nominal")
    twin = next(r for r in cable.rivals["nominal"] if card.entries[r.index].effect == "gravity_compensator")
    assert twin.cosine == pytest.approx(1.0)
    assert twin.separation > 1e3


def test_a_load_on_the_last_link_and_an_error_of_its_parameters_are_one_class(card: Card) -> None:
    assert ("inertial_parameter_error", 3) in rivals(card, entry(card, "payload", 3, "body"), "nominal")


def test_a_refit_hides_the_rotor_of_the_first_joint_and_not_that_of_the_third(card: Card) -> None:
    assert entry(card, "rotor_inertia", 1).absorbed["refit"] == pytest.approx(1.0)
    assert np.isinf(entry(card, "rotor_inertia", 1).shows_from["refit"])
    assert entry(card, "rotor_inertia", 3).absorbed["refit"] < 0.9
    assert entry(card, "rotor_inertia", 1).absorbed["nominal"] == pytest.approx(0.0)


def test_a_law_that_contains_another_by_construction_counts_as_no_confusion(card: Card) -> None:
    assert ("stribeck_friction", 1) not in rivals(card, entry(card, "coulomb_friction", 1), "nominal")


def test_one_constant_speed_cannot_tell_coulomb_from_viscous_friction() -> None:
    """There and back at one speed: the same sign and the same size."""
    time = np.arange(4000) / 200
    speed = np.tanh(40 * np.sin(np.pi * time / 2))[:, None] * np.array([0.4, 0.3, 0.2])
    position = np.cumsum(speed, axis=0) / 200
    swinging = planned(20.0)
    slow = PlannedMotion("square", time, type(swinging.motion)(position, speed, np.gradient(speed, time, axis=0)))
    found = confusability_card(ARM, (slow,), library())
    assert ("viscous_friction", 2) in rivals(found, entry(found, "coulomb_friction", 2), "nominal")
    rich = confusability_card(ARM, (swinging,), library())
    assert ("viscous_friction", 2) not in rivals(rich, entry(rich, "coulomb_friction", 2), "nominal")


def test_twice_the_time_shows_effects_that_are_smaller_by_the_root_of_two(card: Card) -> None:
    twice = confusability_card(ARM, (planned(20.0),), library())
    sizes = [entry(each, "coulomb_friction", 2).shows_from["nominal"] for each in (card, twice)]
    assert sizes[0] / sizes[1] == pytest.approx(np.sqrt(2), rel=0.01)


def test_noise_sets_how_the_joints_are_weighed(card: Card) -> None:
    noisy = confusability_card(ARM, (planned(),), library(), np.array([0.1, 10.0, 0.1]))
    assert_allclose(noisy.noise, [0.1, 10.0, 0.1])
    assert not np.allclose(noisy.cosines["nominal"], card.cosines["nominal"])


def test_tables_tell_the_same_as_the_card(card: Card) -> None:
    content = card_content(card)
    json.dumps(content, allow_nan=False)
    assert len(content["effects"]) == len(card.entries)
    rows = list(csv.DictReader(io.StringIO(card_csv(card))))
    told = {(row["effect"], row["joint"], row["rival"]) for row in rows if row["view"] == "nominal" and row["rival"]}
    assert len(told) == len({(e.effect, e.joint, r.index) for e in card.entries for r in e.rivals["nominal"]})
    assert card_markdown(card).count("\n| ") == 2 * (len(card.entries) + 2)
    assert any("a refit hides" in line and "rotor_inertia 1" in line for line in card_lines(card))


def test_a_motion_comes_from_a_csv_a_recording_or_a_known_trajectory(tmp_path: Path) -> None:
    folder = recording_in(tmp_path / "recording", frame(0, 4), frame(1, 4))
    assert [each.name for each in read_planned_motions(str(folder), ARM)] == ["run-0.csv", "run-1.csv"]
    table = frame(0, 4)[["t", "q1", "q2", "q3"]][::5]
    table.to_csv(tmp_path / "plan.csv", index=False)
    (own,) = read_planned_motions(str(tmp_path / "plan.csv"), ARM)
    exact = motion_at(own.time, 0)
    assert own.rate_hz == pytest.approx(250, rel=1e-3)
    assert_allclose(own.motion.acceleration[50:-50], exact.acceleration[50:-50], atol=2e-3)
    (known,) = read_planned_motions("joint-fourier-rest", ARM, RECORDS)
    assert known.motion.joints == 3


def test_what_is_no_motion_of_this_arm_is_refused_in_one_line(tmp_path: Path) -> None:
    assert "is no CSV file, no recording folder" in refusal(read_planned_motions, "nowhere", ARM, RECORDS)
    (tmp_path / "plan.csv").write_text("t,q1\n0,0\n1,1\n")
    assert "no column 'q2'" in refusal(read_planned_motions, str(tmp_path / "plan.csv"), ARM)
    frame(0, 4)[["t", "q1", "q2", "q3"]][::-1].to_csv(tmp_path / "back.csv", index=False)
    assert "with t increasing" in refusal(read_planned_motions, str(tmp_path / "back.csv"), ARM)
    folder = recording_in(tmp_path / "recording", frame(0, 4), frame(1, 4))
    assert "moves 3 joints" in refusal(read_planned_motions, str(folder), ARM.first(2))


def test_the_command_writes_page_tables_and_pictures(tmp_path: Path) -> None:
    frame(0, 4).to_csv(tmp_path / "plan.csv", index=False)
    arguments = ["model", "confusability", "irb120-arm", str(tmp_path / "plan.csv"), "--noise", "0.05", "--out"]
    result = CliRunner().invoke(main, [*arguments, str(tmp_path / "card")])
    assert result.exit_code == 0, result.output
    names = {each.name for each in (tmp_path / "card").iterdir()}
    assert names == {f"confusability.{ending}" for ending in ("html", "md", "csv", "json")} | {"figures"}
    assert len(list((tmp_path / "card" / "figures").iterdir())) == 6
    wrong = CliRunner().invoke(main, [*arguments[:4], "--noise", "1", "--noise", "2"])
    assert wrong.exit_code == 2
    assert "takes one number or 3" in wrong.stderr
