"""The evidence for a finding: what is left without it, against the variable that it depends on, and its law."""

import numpy as np

from armlab.diagnosis.result import Claim, Diagnosis
from diagnosis.report.axis import axis_for
from diagnosis.report.chart import Layer, Line, Points, chart
from diagnosis.report.looks import FITTED_ROWS, HELD_OUT_ROWS, LAW, SURROGATE, Look
from diagnosis.report.rows import Shown, binned, spaced, without
from diagnosis.report.words import joint_unit, plain
from recordings.run import Array

MOST_DOTS = 700
BINS = 48
SHARP = 0.2  # of the law's own range: a law that scatters less about its mean in a bin is drawn as a line
TURN = 2 * np.pi
BY_VELOCITY = (
    "coulomb_friction",
    "viscous_friction",
    "nonlinear_viscous_friction",
    "stribeck_friction",
    "asymmetric_friction",
    "presliding_hysteresis",
    "joint_coupling",
)
BY_POSITION = ("gravity_compensator", "cable_stiffness", "backlash")
BY_TIME = ("torque_offset", "external_contact", "friction_drift")
SPANS = {"position": ("rad", "m"), "velocity": ("rad/s", "m/s"), "acceleration": ("rad/s²", "m/s²")}


def evidence_picture(diagnosis: Diagnosis, data: Shown, claim: Claim) -> str:
    """Dots: measured torque that is left without the finding. Line: what the finding says of it."""
    joint = claim.evidence.joint
    label, x = variable_of(diagnosis, data, claim)
    left, law = without(diagnosis, claim, joint), claim.prediction[:, joint]
    used, held = data.used(joint), data.held_out(joint)
    layers: list[Layer] = []
    for rows, look in ((used[~held[used]], FITTED_ROWS), (used[held[used]], HELD_OUT_ROWS)):
        chosen = spaced(rows, MOST_DOTS // 2)
        layers.append(Points(x[chosen], left[chosen], look))
    layers += _law(x[used], law[used], LAW if claim.candidate else SURROGATE)
    size = joint_unit(diagnosis.simulation.arm, joint)
    y = axis_for(f"left without it, {size}", np.quantile(left[used], [0.002, 0.998]), law[used])
    title = f"{plain(claim.effect).capitalize()}, joint {joint + 1}"
    return chart(
        title, axis_for(label, x[used]), y, layers, f"{title}: torque left without it against {label}, and its law"
    )


def variable_of(diagnosis: Diagnosis, data: Shown, claim: Claim) -> tuple[str, Array]:
    """Label and values (rows,) of what the finding depends on; its own torque where no single variable tells it."""
    arm, observed = diagnosis.simulation.arm, data.observed
    joint = claim.evidence.joint
    moving = (claim.joints[1] if len(claim.joints) > 1 else claim.joint or 0) - 1
    if claim.effect in BY_VELOCITY and moving >= 0:
        return _motion(diagnosis, data, "velocity", moving)
    if claim.effect in BY_POSITION and moving >= 0:
        return _motion(diagnosis, data, "position", moving)
    if claim.effect == "rotor_inertia" and moving >= 0:
        return _motion(diagnosis, data, "acceleration", moving)
    if claim.effect == "torque_ripple" and moving >= 0:
        return _folded(data, claim, moving)
    if claim.effect in BY_TIME:
        return "time from the start of the run, s", observed.time
    if claim.depends_on[:1] == ("time",):
        return "time from the start of the run, s", observed.time
    for name in claim.depends_on:
        kind, _, which = name.rpartition("_")
        if kind in SPANS and which.isdigit():
            return _motion(diagnosis, data, kind, int(which) - 1)
        if kind == "torque" and which.isdigit():
            return _load(diagnosis, data, claim, int(which) - 1)
    return f"torque that it predicts, {joint_unit(arm, joint)}", claim.prediction[:, joint]


def _motion(diagnosis: Diagnosis, data: Shown, kind: str, joint: int) -> tuple[str, Array]:
    units = SPANS[kind]
    unit = units[0] if diagnosis.simulation.arm.joints[joint].kind == "revolute" else units[1]
    return f"{kind} of joint {joint + 1}, {unit}", data.observed.kept(kind)[:, joint]


def _load(diagnosis: Diagnosis, data: Shown, claim: Claim, joint: int) -> tuple[str, Array]:
    """Torque of the model without the finding."""
    torque = data.observed.torque[:, joint] - data.final[:, joint] - claim.prediction[:, joint]
    return f"torque of the model at joint {joint + 1}, {joint_unit(diagnosis.simulation.arm, joint)}", torque


def _folded(data: Shown, claim: Claim, joint: int) -> tuple[str, Array]:
    """Position within one wave of a ripple."""
    order = next((each.value for each in claim.parameters if each.name == "order"), 1.0)
    waves = float(order) if isinstance(order, float) and order else 1.0
    position = data.observed.kept("position")[:, joint]
    return f"position of joint {joint + 1} within a wave of 1/{waves:.4g} turn, share", (position * waves / TURN) % 1.0


def _law(x: Array, law: Array, look: Look) -> list[Layer]:
    """A line where the law is a function of this variable, dots where it is not."""
    across, height, scatter = binned(x, law, BINS)
    if np.ptp(law) > 0 and np.median(scatter) < SHARP * np.std(law):
        return [Line(across, height, look)]
    chosen = spaced(np.arange(len(x)), MOST_DOTS // 2)
    return [Points(x[chosen], law[chosen], look)]
