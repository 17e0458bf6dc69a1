"""What a robot file says of its joints is the simulation: a finding is a difference to it."""

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from example_log import record_example

from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.torque.diagnose import diagnose
from armlab.diagnosis.torque.rows.simulation import Simulation, read_simulation
from armlab.effects.friction import CoulombFriction, LevelsAndSlopes, PowerFriction, StribeckFriction, ViscousFriction
from armlab.effects.term import Term
from armlab.identification.model_file import model_content, write_model
from armlab.identification.nominal import nominal_model
from armlab.identification.structure import Structure
from armlab.identification.torque_model import TorqueModel
from armlab.recordings.load import load_recording
from armlab.report.torque.content import parameter_table
from armlab.report.torque.torque_verdict import verdict_lines
from armlab.report.verdict_files import make_verdict
from problem.drive_torque import drive_torque
from problem.motion import Motion
from problem.robot_file import load_arm

ARM = """<mujoco><compiler angle="radian"/><worldbody>
<body name="a" pos="0 0 .5" gravcomp="1"><joint name="lift" axis="0 1 0" damping="1.2" frictionloss="2" ref="0.3"/>
<inertial mass="3" pos=".2 0 .02" diaginertia=".01 .05 .05"/>
<body name="b" pos=".4 0 0"><joint name="bend" axis="0 1 0" damping=".5" frictionloss="1" stiffness="6" springref=".4"/>
<inertial mass="1" pos=".15 0 0" diaginertia=".004 .02 .02"/></body></body></worldbody></mujoco>"""
MORE_FRICTION = (-2.0, 0.5)  # N m, of the arm beyond its file: the first joint has none at all


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> Diagnosis:
    """The diagnosis of an arm whose friction is not that of its file."""
    folder = tmp_path_factory.mktemp("recorded")
    (folder / "arm.xml").write_text(ARM)
    arm, rng = load_arm(str(folder / "arm.xml")), np.random.default_rng(3)
    time = np.arange(0, 12, 0.01)
    for number in (1, 2):
        waves = [
            [(0.5 / order, rng.uniform(0.6, 2.2) * order, rng.uniform(0, 6)) for order in (1, 2, 3)] for _ in range(2)
        ]
        position, velocity, acceleration = (
            np.column_stack([sum(a * w**k * np.sin(w * time + p + k * np.pi / 2) for a, w, p in own) for own in waves])
            for k in range(3)
        )
        torque = drive_torque(arm, Motion(position, velocity, acceleration)) + MORE_FRICTION * np.sign(velocity)
        table = np.column_stack([time, position, torque + 0.1 * rng.standard_normal(torque.shape)])
        pd.DataFrame(table, columns=["t", "q1", "q2", "tau1", "tau2"]).to_csv(folder / f"run-{number}.csv", index=False)
    content = {
        "schema": "recording/1",
        "robot": "arm.xml",
        "columns": {"time": "t", "position": ["q1", "q2"], "torque": ["tau1", "tau2"]},
        "units": {"time": "s", "position": "rad", "torque": "N.m"},
        "runs": [{"file": "run-1.csv", "role": "identify"}, {"file": "run-2.csv", "role": "validate"}],
    }
    (folder / "recording.yaml").write_text(yaml.safe_dump(content))
    return diagnose(load_recording(Path(folder)))


def test_what_stands_in_the_file_is_not_missing_and_the_difference_is_found_both_ways(found: Diagnosis) -> None:
    names = {(claim.effect, claim.joint): claim for claim in found.claims}
    assert set(names) == {("coulomb_friction", 1), ("coulomb_friction", 2)}
    assert found.setup is None or not found.setup.findings
    for (_, joint), claim in names.items():
        assert claim.parameters[0].value == pytest.approx(MORE_FRICTION[joint - 1], abs=0.05)


def test_a_verdict_says_what_the_simulation_has_beside_what_has_to_be_added(found: Diagnosis) -> None:
    entries = json.loads(make_verdict(found).to_json())["findings"]
    assert {entry["joint"]: entry["parameters"]["level"]["simulation"] for entry in entries} == {1: 2.0, 2: 1.0}
    table = parameter_table(next(claim for claim in found.claims if claim.joint == 2))
    assert table.headings[1:4] == ["to be added", "95 % interval", "in the simulation"]
    assert table.rows[0][3] == "1"


def test_the_summary_says_too_much_where_the_file_has_more_than_the_arm(found: Diagnosis) -> None:
    summary = " ".join("\n".join(verdict_lines(found)).split())
    assert re.search(r"too much Coulomb friction, 2\.00 of 2\.00 N m", summary)
    assert re.search(r"Coulomb friction 0\.\d+ N m beyond 1\.00 N m", summary)


def test_the_model_found_holds_the_laws_of_the_file_and_the_differences(found: Diagnosis) -> None:
    assert found.model is not None
    levels = [each.coefficients[0] for each in found.model.effects if each.candidate.effect == "coulomb_friction"]
    assert sum(levels) == pytest.approx(3.0 + sum(MORE_FRICTION), abs=0.1)
    written = model_content(found.model, Path())["components"]
    sources = [(each["effect"], each["joint"]) for each in written if each.get("source") == "simulation"]
    assert sorted(sources) == [
        ("cable_stiffness", 2),
        *(("coulomb_friction", joint) for joint in (1, 2)),
        *(("viscous_friction", joint) for joint in (1, 2)),
    ]


@pytest.mark.parametrize(
    ("law", "expected"),
    [
        (CoulombFriction, [2.0]),
        (ViscousFriction, [1.2]),
        (StribeckFriction, [2.0, 0.0]),
        (LevelsAndSlopes, [2.0, 2.0, 1.2, 1.2]),
        (PowerFriction, [0.0]),
    ],
)
def test_friction_of_the_file_counts_in_each_law_of_which_it_is_a_special_case(
    tmp_path: Path, law: type[Term], expected: list[float]
) -> None:
    (tmp_path / "arm.xml").write_text(ARM)
    arm = load_arm(str(tmp_path / "arm.xml"))
    simulation = Simulation("nominal", arm, arm.parameters, nominal_model(arm, "arm.xml"))
    shape = {StribeckFriction: (0.05, 2.0), PowerFriction: (2.0,)}.get(law, ())
    candidate = law.at(arm, 1, shape=shape, bounds=((0.0, 9.0),) * len(shape))
    np.testing.assert_allclose(simulation.coefficients_of(candidate), expected, atol=1e-9)


@pytest.mark.parametrize(("provenance", "fitted"), [({}, False), ({"settings": {}}, True), ({"runs": ["a"]}, True)])
def test_a_simulation_was_fitted_where_its_provenance_tells_of_a_fit(
    provenance: dict[str, object], fitted: bool, tmp_path: Path
) -> None:
    recording = load_recording(record_example(tmp_path / "example"))
    structure = Structure(recording.arm, ())
    values = structure.base.values(recording.arm.parameters)
    model = TorqueModel(recording.robot, structure, values, inertial=recording.arm.parameters, provenance=provenance)
    write_model(model, tmp_path / "model.yaml")
    assert read_simulation(replace(recording, simulation=tmp_path / "model.yaml"), None).is_fitted is fitted
