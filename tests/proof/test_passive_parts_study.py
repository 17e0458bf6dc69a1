"""The study of laws that stand in robot files: what it simulates, and what it counts as enough."""

from pathlib import Path

import numpy as np
from passive_parts_study import Case, Sines, append_case, judge, read_cases, simulate, write_arm

from problem.drive_torque import drive_torque
from problem.mjcf import compile_mjcf
from problem.robot_file import load_arm


def case(number: int, findings: str, hidden: int | None = None, passive: bool = True) -> Case:
    return Case(number, passive, hidden, 0.1, findings, "mismatch" if findings else "none")


def test_more_false_findings_than_chance_at_one_percent_are_too_many() -> None:
    clean = [case(number, "") for number in range(300)]
    assert judge(clean)[0].endswith("0 of 300 recordings with nothing missing: as wanted")
    assert judge([*clean, *(case(number, "cable_stiffness@1") for number in range(10))])[0].endswith("too many")


def test_hidden_friction_counts_as_named_at_its_joint_alone_and_beside_the_same_arms_without_parts() -> None:
    numbers = range(40)
    with_parts = [case(number, "coulomb_friction@2", hidden=1 + number % 2) for number in numbers]
    without = [
        case(number, f"coulomb_friction@{1 + number % 2}", hidden=1 + number % 2, passive=False) for number in range(40)
    ]
    assert judge([*with_parts, *without])[-1].endswith("less often")
    assert "named: 20 of 40 with passive parts, 40 of 40 without" in judge([*with_parts, *without])[-1]


def test_a_simulated_torque_is_that_of_the_arm_away_from_reversals(tmp_path: Path) -> None:
    write_arm(tmp_path / "arm.xml", np.random.default_rng(1), passive=True)
    arm = load_arm(str(tmp_path / "arm.xml"))
    wanted = Sines.draw(len(arm), np.random.default_rng(2))
    motion = wanted.motion()
    torque = simulate(compile_mjcf(tmp_path / "arm.xml"), wanted)
    away = np.abs(motion.velocity) > 0.1
    assert arm.joint_laws
    np.testing.assert_allclose(torque[away], drive_torque(arm, motion)[away], atol=1e-9)


def test_an_interrupted_study_goes_on_with_the_rows_that_it_has(tmp_path: Path) -> None:
    made = [case(0, ""), case(1, "coulomb_friction@2", hidden=2), case(1, "", hidden=1, passive=False)]
    assert read_cases(tmp_path / "rows.csv") == []
    for each in made:
        append_case(tmp_path / "rows.csv", each)
    assert read_cases(tmp_path / "rows.csv") == made
