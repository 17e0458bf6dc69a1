"""A case made from its plan: what is hidden gets its size, and the recording folder and the answer are written."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from armlab.common.settings import to_plain_data, validate
from armlab.proof.blind.servo.servo_arms import write_mjcf
from armlab.proof.blind.servo.servo_engine import ServoArm
from armlab.proof.blind.servo.servo_hidden import Hidden, servo_parameters
from armlab.proof.blind.servo.servo_oracle import ServoOracle, find_size, record
from armlab.proof.blind.servo.servo_plan import ServoCase
from armlab.proof.blind.servo.servo_truth import MotionTruth

MAX_DRAWS = 12  # of what is hidden, until it can be seen


@dataclass(frozen=True, eq=False)
class MadeCase:
    """A case with what is hidden.

    wanted, multiples: detection limits of each difference, as drawn and as it is. passed_over: kinds that the oracle
    cannot see on this arm at any sensible size.
    """

    case: ServoCase
    arm: ServoArm
    hidden: tuple[Hidden, ...]
    wanted: tuple[float, ...]
    multiples: tuple[float, ...]
    passed_over: tuple[str, ...]


def make_case(case: ServoCase) -> MadeCase:
    """Draws what is hidden, one after the other, each with its size on the arm with those before."""
    arm = case.drawn[0]
    hidden: list[Hidden] = []
    sizes: list[float] = []
    passed_over: list[str] = []
    for place, wanted in enumerate(case.multiples):
        oracle = ServoOracle(case, arm)
        for attempt in range(MAX_DRAWS):
            drawn = case.draw_hidden(place, attempt)
            if drawn.facts.effect in [each.facts.effect for each in hidden]:
                continue
            sized, multiple = find_size(oracle, drawn, wanted)
            if multiple >= min(1.0, wanted * 0.8):
                hidden.append(sized)
                sizes.append(wanted)
                arm = sized.apply(arm)
                break
            passed_over.append(drawn.kind)
    oracle = ServoOracle(case, arm)
    multiples = tuple(oracle.multiple(each, arm, _without(case, hidden, each)) for each in hidden)
    return MadeCase(case, arm, tuple(hidden), tuple(sizes), multiples, tuple(passed_over))


def _without(case: ServoCase, hidden: list[Hidden], left_out: Hidden) -> ServoArm:
    arm = case.drawn[0]
    for each in hidden:
        arm = arm if each is left_out else each.apply(arm)
    return arm


def write_case(made: MadeCase, observation: Path, truth: Path) -> None:
    """Writes the recording folder and the answer."""
    case = made.case
    observation.mkdir(parents=True)
    names = [[f"{letter}{joint + 1}" for joint in range(made.arm.joints)] for letter in "cq"]
    runs = []
    for number, run in enumerate(case.runs):
        stamps, read = record(case, made.arm, number)
        table = np.column_stack([stamps, run.command[-len(read) :], read])
        file = f"run-{number + 1}.csv"
        frame = pd.DataFrame(np.round(table, 9), columns=["t", *names[0], *names[1]])
        frame.to_csv(observation / file, index=False, lineterminator="\n")
        runs.append({"file": file, "role": run.role})
    simulated = case.drawn[0]
    (observation / "arm.xml").write_text(write_mjcf(simulated, case.knowledge == "known"), encoding="utf-8")
    settings = {
        "schema": "recording/1",
        "robot": "arm.xml",
        "columns": {"time": "t", "reference_position": names[0], "position": names[1]},
        "units": {"time": "s", "position": "rad", "reference_position": "rad"},
        **({} if case.knowledge == "unknown" else {"controller": _controller(case, simulated)}),
        "runs": runs,
    }
    text = yaml.safe_dump(to_plain_data(settings), sort_keys=False, default_flow_style=None, width=110)
    (observation / "recording.yaml").write_text(text, encoding="utf-8")
    content = validate(MotionTruth, json.loads(json.dumps(answer(made))), case.name)
    truth.write_text(content.model_dump_json(by_alias=True, indent=1) + "\n", encoding="utf-8")


def _controller(case: ServoCase, arm: ServoArm) -> dict[str, Any]:
    """What the recording says of the drives, as the simulation file has them."""
    servos = arm.servos
    integral = [servo.ki for servo in servos]
    return {
        "type": "pd",
        "kp": [servo.kp if case.knowledge == "known" else None for servo in servos],
        "kd": [servo.kd for servo in servos],
        **({"ki": integral, "integral_limit": [servo.integral_limit for servo in servos]} if any(integral) else {}),
        "torque_limit": [servo.limit for servo in servos],
        **({"rate_hz": case.rate_hz / case.hold} if case.hold > 1 else {}),
        **({"read_delay": [case.read_gap_s * joint for joint in range(arm.joints)]} if case.read_gap_s > 0 else {}),
    }


def answer(made: MadeCase) -> dict[str, Any]:
    """What is true of a case (schema motion-truth/1)."""
    case, arm = made.case, made.arm
    injected = [
        {
            "kind": each.kind,
            "effect": each.facts.effect,
            "equivalent": each.facts.equivalent,
            "part": each.facts.part,
            "joint": each.place(arm),
            "size": each.size,
            "falling": each.falling,
            "parameters": {name: value for name, (value, _) in each.parameters(arm).items()},
            "wanted": wanted,
            "multiple": multiple,
        }
        for each, wanted, multiple in zip(made.hidden, made.wanted, made.multiples, strict=True)
    ]
    drives = [
        {effect: {name: value for name, (value, _) in own.items()} for effect, own in servo_parameters(servo).items()}
        for servo in arm.servos
    ]
    return {
        "schema": "motion-truth/1",
        "case": case.name,
        "kind": case.kind,
        "law": case.law,
        "knowledge": case.knowledge,
        "joints": arm.joints,
        "rate_hz": case.rate_hz,
        "hold_hz": case.rate_hz / case.hold,
        "counts": round(2 * np.pi / arm.servos[0].count),
        "jitter_s": case.jitter_s,
        "read_gap_s": case.read_gap_s,
        "motions": [run.family for run in case.runs],
        "injected": injected,
        "passed_over": made.passed_over,
        "drives": drives,
    }
