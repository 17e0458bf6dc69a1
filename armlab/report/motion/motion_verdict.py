"""The files of a motion-only verdict: verdict.json, model.yaml and the simulation with the found numbers."""

import math
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from armlab.common.errors import InputError
from armlab.diagnosis.formats import (
    VERDICT_SCHEMA,
    ClassMember,
    CurrentEntry,
    FindingEntry,
    FitEntry,
    LocatedEntry,
    ParameterEntry,
    RivalEntry,
    StoryEntry,
    UnexplainedEntry,
    VerdictFile,
    WhereEntry,
    kind_of_effect,
)
from armlab.diagnosis.motion import servo_plugin
from armlab.diagnosis.motion.export import lines_without_field, mjcf_text, servos_json
from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ReplayError
from armlab.diagnosis.motion.naming import weigh_servo
from armlab.diagnosis.motion.robot_learning import isaac_lab_text, mjlab_text
from armlab.diagnosis.motion.ros2_control import controllers_text, ros_urdf_text
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, PARAMETERS
from armlab.diagnosis.settings import Settings
from armlab.diagnosis.tuning import NamingTuning
from armlab.effects.library import effect_named
from armlab.report.motion.motion_words import summary_of
from armlab.report.motion.stated_numbers import StatedNumber, stated_causes, stated_numbers
from armlab.report.torque.naming_files import WeighedOutcome, names_texts, outcome_of
from problem.robot_file import built_in_arms

MODEL, SIMULATION = "model.yaml", "simulation.xml"
IN_COMPONENTS = ("viscous_friction", "coulomb_friction", "rotor_inertia", "load_dependent_friction")


def motion_texts(diagnosis: MotionDiagnosis, folder: Path) -> dict[str, str]:
    """All files of the verdict but the report, as they are to stand in a folder."""
    texts = {"verdict.json": make_motion_verdict(diagnosis).to_json()}
    texts |= names_texts(_weighed_findings(diagnosis), Settings())
    if diagnosis.servos is not None:
        simulation, servos = diagnosis.simulation, diagnosis.servos
        step = float(simulation.model().opt.timestep)
        texts[MODEL] = model_text(diagnosis, folder)
        texts[SIMULATION], notes = mjcf_text(simulation, servos)
        texts["isaaclab_actuators.py"] = isaac_lab_text(simulation, servos, step)
        texts["mjlab_actuators.py"] = mjlab_text(simulation, servos, step)
        texts["servos.json"] = servos_json(simulation, servos)
        texts["servo_plugin.py"] = Path(servo_plugin.__file__).read_text(encoding="utf-8")
        missing = [*lines_without_field(simulation, servos), *(f"{SIMULATION}: {note}" for note in notes)]
        try:
            texts["robot.urdf"] = ros_urdf_text(simulation, servos)
            texts["controllers.yaml"] = controllers_text(simulation, servos, step)
        except InputError as error:
            missing.append(f"no robot.urdf: {error}")
        texts["not-in-simulation.txt"] = "\n".join([*missing, ""]) if missing else "everything is in the file\n"
    return texts


def _weighed_findings(diagnosis: MotionDiagnosis) -> Iterator[WeighedOutcome]:
    """All differences with the names that they may have."""
    last = diagnosis.simulation.last_link
    stated = stated_numbers(diagnosis)
    for finding in diagnosis.findings:
        weighed = weigh_servo(finding, last)
        own = next((each for each in stated if each.finding is finding), None)
        if own is None:
            yield WeighedOutcome(finding.effect, finding.joint, "not stated", weighed)
        else:
            outcome = outcome_of(own.effect, own.naming.members(NamingTuning()))
            yield WeighedOutcome(own.effect, finding.joint, outcome, weighed)


def make_motion_verdict(diagnosis: MotionDiagnosis) -> VerdictFile:
    """The content of `verdict.json`. Errors are of positions, rad (m): there is no torque to compare with."""
    told = stated_numbers(diagnosis)
    return VerdictFile(
        schema=VERDICT_SCHEMA,
        status=diagnosis.status,
        summary=summary_of(diagnosis),
        story=tuple(
            StoryEntry(cause=each.cause, joints=each.joints, share_of_gap=each.share, findings=each.findings)
            for each in stated_causes(told)
        ),
        located=_located(diagnosis),
        findings=tuple(_finding(each, diagnosis.simulation.last_link) for each in told),
        unexplained=_unexplained(diagnosis),
        fit=tuple(_fit(each, _current(diagnosis, each.joint)) for each in diagnosis.errors),
    )


def _located(diagnosis: MotionDiagnosis) -> tuple[LocatedEntry, ...]:
    places, recorded = {each.joint for each in diagnosis.findings}, {each.joint for each in diagnosis.errors}
    if places - recorded:  # a mass at the tool, where the last joint was not recorded
        places.add(max(recorded))
    gaps = {
        each.joint: max((each.before if each.before is not None else each.command) ** 2 - each.after**2, 0.0)
        for each in diagnosis.errors
        if each.joint in places
    }
    whole = max(sum(gaps.values()), 1e-300)
    where = WhereEntry(variable="reference_position", regime="wherever the joint is driven")
    located = [LocatedEntry(joint=joint, share=min(gap / whole, 1.0), where=where) for joint, gap in gaps.items()]
    return tuple(sorted(located, key=lambda entry: -entry.share))


def _finding(told: StatedNumber, last: int) -> FindingEntry:
    """An entry of the verdict. last: the link that carries the tool."""
    each, naming = told.finding, told.naming
    parameter = ParameterEntry(
        value=each.value, ci95=(float(each.interval[0]), float(each.interval[1])), unit=each.parameter.unit
    )
    if math.isfinite(each.nominal) and each.nominal < INFINITE_LIMIT:
        parameter = parameter.model_copy(update={"simulation": float(each.nominal)})
    members = [
        ClassMember(effect=member.effect, joint=member.joint, probability=member.probability)
        for member in naming.members(NamingTuning())
    ]
    entry = FindingEntry(
        effect=told.effect,
        kind=kind_of_effect(effect_named(told.effect)),
        joint=each.joint,
        joints=(each.joint,),
        form=each.name if told.effect == "controller_gain_error" else None,
        parameters={} if naming.is_unknown else {each.name: parameter},
        minor=told.minor,
        probability=naming.probability_of(told.effect, each.joint),
        equation=each.equation,
        heldout_rms_before=each.before,
        heldout_rms_after=each.after,
        p_value=each.p_value,
        share_of_gap=told.share,
        rivals=tuple(
            RivalEntry(effect=rival, joint=last if rival == "payload" else each.joint) for rival in each.rivals
        ),
        next_experiment=(each.parameter.experiment or effect_named(each.effect).experiment) if each.rivals else None,
    )
    return entry.model_copy(update={"class_": tuple(members)}) if members else entry


def _unexplained(diagnosis: MotionDiagnosis) -> tuple[UnexplainedEntry, ...]:
    """Joints with stretches that their servo does not explain; share: of their windows."""
    entries = []
    for row, chosen in enumerate(diagnosis.chosen):
        if chosen is not None and len(chosen.odd):
            share = len(chosen.odd) / (len(chosen.odd) + chosen.fit.windows)
            joint = diagnosis.simulation.number_of(row)
            entries.append(UnexplainedEntry(joint=joint, share=share, depends_on=("time",)))
    return tuple(entries)


def _current(diagnosis: MotionDiagnosis, joint: int) -> CurrentEntry | None:
    for each in diagnosis.currents:
        if each.joint == joint:
            return CurrentEntry(form=each.form, correlation=each.found, before=each.given, with_damping=each.inside)
    return None


def _fit(each: ReplayError, current: CurrentEntry | None) -> FitEntry:
    before = each.before if each.before is not None else each.command
    gap = before - each.floor
    return FitEntry(
        joint=each.joint,
        heldout_rms_before=before,
        heldout_rms_after=each.after,
        noise_floor=float(each.floor),
        gap_closed=float((before - each.after) / gap) if gap > 0 else None,
        replay_rms_before=each.replay_before,
        replay_rms_after=each.replay_after,
        current=current,
    )


def model_text(diagnosis: MotionDiagnosis, folder: Path) -> str:
    """`model.yaml`: the links of the robot, friction and rotors as components, and the controller."""
    recording, servos = diagnosis.recording, diagnosis.servos
    assert servos is not None
    robot = recording.robot
    if robot not in built_in_arms():
        robot = Path(os.path.relpath(recording.folder / robot, folder)).as_posix()
    ten = diagnosis.simulation.arm.parameters.reshape(-1, 10)
    content: dict[str, Any] = {
        "schema": "model/1",
        "robot": robot,
        "links": [
            {"mass": float(row[0]), "first_moment": row[1:4].tolist(), "inertia": row[4:].tolist()} for row in ten
        ],
        "components": _components(diagnosis),
        "controller": controller_entry(diagnosis),
        "provenance": {"recording": recording.name, "runs": sorted({run.file for run in recording.runs})},
    }
    return yaml.safe_dump(content, sort_keys=False, default_flow_style=None, width=110)


def _components(diagnosis: MotionDiagnosis) -> list[dict[str, Any]]:
    claimed = {(each.effect, each.joint) for each in diagnosis.findings}
    entries = []
    for row, chosen in enumerate(diagnosis.chosen):
        joint = diagnosis.simulation.number_of(row)
        ends = chosen.fit.interval() if chosen is not None else None
        for place, parameter in enumerate(PARAMETERS):
            assert diagnosis.servos is not None
            value = float(diagnosis.servos.values[row, place])
            if parameter.effect not in IN_COMPONENTS or value == 0:
                continue
            fitted = chosen is not None and bool(chosen.fit.free[place])
            interval = [float(ends[0, place]), float(ends[1, place])] if fitted and ends is not None else None
            entry = {"effect": parameter.effect, "joint": joint, "joints": [joint]}
            entry |= {"claimed": (parameter.effect, joint) in claimed}
            entries.append(entry | {"parameters": {parameter.name: _number(value, interval, parameter.unit)}})
        entries += _stribeck_component(diagnosis, row, joint, claimed)
    return entries


def _number(value: float, interval: list[float] | None, unit: str) -> dict[str, Any]:
    return {"value": value, "ci95": interval, "unit": unit}


def _stribeck_component(
    diagnosis: MotionDiagnosis, row: int, joint: int, claimed: set[tuple[str, int]]
) -> Iterator[dict[str, Any]]:
    """What a joint's friction is at rest beyond its Coulomb friction: a Stribeck friction without level."""
    assert diagnosis.servos is not None
    excess, speed = (float(diagnosis.servos.get(key)[row]) for key in ("static_excess", "stribeck_speed"))
    if excess > 0:
        numbers = {
            "level": _number(0.0, None, "N.m"),
            "static_level": _number(excess, None, "N.m"),
            "velocity": _number(speed, None, "rad/s"),
            "exponent": _number(2.0, None, "1"),
        }
        entry = {"effect": "stribeck_friction", "joint": joint, "joints": [joint]}
        yield entry | {"claimed": ("stribeck_friction", joint) in claimed, "parameters": numbers}


def controller_entry(diagnosis: MotionDiagnosis) -> dict[str, Any]:
    """The controller as `recording.yaml` takes it, one entry a joint; damping stands in components."""
    servos = diagnosis.servos
    assert servos is not None
    limits = [float(each) if each < INFINITE_LIMIT else None for each in servos.get("limit")]
    delays = servos.get("delay")
    entry: dict[str, Any] = {"type": "pd", "kp": servos.get("kp").tolist(), "kd": servos.get("kd").tolist()}
    entry |= {"reference_velocity": "zero", "feedforward": "none", "torque_limit": limits}
    entry |= {"delay": np.maximum(delays, 0.0).tolist()}
    others = {"offset": servos.get("offset"), "dead_band": servos.get("dead_band"), "ki": servos.get("ki")}
    others["limit_slope"] = servos.get("limit_slope")
    if servos.get("ki").any():
        bounds = servos.get("integral_limit").tolist()
        entry |= {"integral_limit": [each if each < INFINITE_LIMIT else None for each in bounds]}
        others["ki_speed"] = servos.get("ki_speed")
    others["read_delay"] = diagnosis.simulation.read_delay + np.maximum(-delays, 0.0)
    return entry | {name: values.tolist() for name, values in others.items() if values.any()}
