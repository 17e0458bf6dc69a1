"""A verdict has the same names and numbers whether it was just made or read from its file."""

from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from refusals import refusal

import armlab
from armlab.diagnosis.formats import FindingEntry, ParameterEntry, VerdictFile
from armlab.recordings.recording import Recording
from problem.motion import Motion
from problem.regressor import rigid_body_torque

ROBOT = """\
name: pendulum
dh_convention: standard
gravity: [0, -9.81, 0]
joints: [{name: joint1, type: revolute, a: 0.5, d: 0, alpha: 0}]
links: [{mass: 2.0, first_moment: [-0.5, 0, 0], inertia: [0.01, 0.2, 0.2, 0, 0, 0]}]
"""


def swing(arm, seed):
    """Six seconds of a pendulum with viscous friction of 1.5 N m s/rad that its robot file does not have."""
    rng = np.random.default_rng(seed)
    time, omega = np.arange(600) / 100, 2 * np.pi * 0.2 * np.arange(1, 5)
    a, b = rng.normal(0, 0.2, (2, 4, 1))
    sine, cosine = np.sin(np.outer(time, omega)), np.cos(np.outer(time, omega))
    velocity = (cosine * omega) @ a - (sine * omega) @ b
    motion = Motion(sine @ a + cosine @ b, velocity, -(sine * omega**2) @ a - (cosine * omega**2) @ b)
    torque = rigid_body_torque(arm, motion) + 1.5 * velocity + rng.normal(0, 0.02, velocity.shape)
    return pd.DataFrame({"t": time, "q_rad": motion.position[:, 0], "tau_Nm": torque[:, 0]})


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("verdict")


@pytest.fixture(scope="module")
def live(folder, tmp_path_factory):
    robot = tmp_path_factory.mktemp("robot") / "pendulum.yaml"
    robot.write_text(ROBOT)
    arm = armlab.read_robot(str(robot))
    options = {"position": "q_rad", "torque": "tau_Nm", "units": {"position": "rad", "torque": "N.m"}}
    swings = Recording.from_dataframe(swing(arm, 1), robot, validate=swing(arm, 2), **options)
    return armlab.diagnose(swings, as_read=True, out=folder)


@pytest.fixture(scope="module")
def stored(live, folder):
    return armlab.read_verdict(folder)


def test_a_folder_that_is_given_has_the_files_of_the_command(live, folder):
    assert {"verdict.json", "model.yaml", "report.html", "names.json", "steps.json"} <= {
        each.name for each in folder.iterdir()
    }


def test_every_key_of_a_verdict_file_is_an_attribute():
    keys = {name.removesuffix("_") for name in VerdictFile.model_fields} - {"schema"}
    assert keys <= {each.name for each in fields(armlab.Verdict)}


def test_a_verdict_that_was_read_says_what_the_live_one_said(live, stored):
    for each in fields(armlab.Verdict):
        if each.name in VerdictFile.model_fields:
            assert getattr(stored, each.name) == getattr(live, each.name), each.name
    (found,) = live.findings
    assert (found.effect, found.joint) == ("viscous_friction", 1)
    assert found.parameters["coefficient"].value == pytest.approx(1.5, abs=0.02)
    assert stored.table.equals(live.table)
    assert (live.recording.name, stored.recording) == ("recording", None)


def test_a_verdict_is_read_from_its_folder_or_its_file(stored):
    again = armlab.read_verdict(str(stored.folder / "verdict.json"))
    assert again.findings == stored.findings
    assert "cannot read nowhere" in refusal(armlab.read_verdict, "nowhere")


def test_the_model_of_both_predicts_the_same(live, stored):
    first, second = (armlab.predict(each.model, live.recording) for each in (live, stored))
    assert [each.relative_percent for each in first.errors] == pytest.approx(
        [each.relative_percent for each in second.errors], rel=1e-3
    )


def test_both_draw_their_errors_and_a_live_one_its_torques(live, stored):
    assert live.plot()._repr_png_() == stored.plot()._repr_png_()
    (axes,) = live.plot(joint=1).axes
    assert [line.get_label() for line in axes.lines] == [
        "measured",
        "simulation as given",
        "rigid body refitted",
        "with what was found",
    ]
    assert "joint 2: give one of 1" in refusal(live.plot, 2)
    assert "a verdict that was read has no signals" in refusal(stored.plot, 1)
    assert "nothing to draw" in refusal(replace(stored, fit=()).plot)


def test_a_table_has_a_row_a_number_and_a_component_of_a_vector(stored):
    centre = ParameterEntry(value=(1.0, 2.0), ci95=((0.5, 1.5), (1.5, 2.5)), unit="m")
    own = {"joints": (), "equation": "", "heldout_rms_before": 1.0, "heldout_rms_after": 1.0, "rivals": ()}
    body = FindingEntry(effect="payload", joint=3, parameters={"centre": centre}, **own)
    late = FindingEntry(effect="torque_sign", joint=None, parameters={}, **own)
    table = replace(stored, findings=(body, late)).table
    assert table["number"].tolist() == ["centre 1", "centre 2", ""]
    assert table[["value", "low", "high"]].to_numpy()[:2].tolist() == [[1.0, 0.5, 1.5], [2.0, 1.5, 2.5]]
    assert table["joint"].isna().tolist() == [False, False, True]


def test_a_verdict_shows_its_findings_escaped_in_a_notebook(stored):
    finding = stored.findings[0]
    change = {"effect": "friction<b>", "equation": "a < 1"}
    many = [finding.model_copy(update={**change, "joint": joint}) for joint in range(1, 20)]
    shown = replace(stored, summary="Much <script>", findings=tuple(many))
    html = shown._repr_html_()
    assert "<td>friction&lt;b&gt;</td><td>1</td><td>a &lt; 1</td>" in html
    assert "Much &lt;script&gt;" in html
    assert "and 7 more" in html
    assert repr(shown).splitlines()[0].endswith(": mismatch; findings: 19")
    assert repr(shown).splitlines()[-1] == "  and 15 more findings"
    nothing = replace(stored, status="inconclusive", summary="Too short.", findings=(), folder=Path("out"))
    assert repr(nothing) == "Verdict of out: inconclusive; findings: 0\n  Too short."
