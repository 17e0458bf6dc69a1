"""The page of a motion-only verdict: findings, errors before and after, one figure a joint, what the files hold."""

from html import escape

import numpy as np

from armlab.diagnosis.motion.diagnose import MotionDiagnosis
from armlab.diagnosis.motion.export import lines_without_field
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, PARAMETERS
from armlab.diagnosis.motion.words import finding_phrase, summary_of
from armlab.diagnosis.report.charts import FOUND_LOOK, GIVEN_LOOK, MEASURED_LOOK, Layer, Line, draw_chart, fit_axis
from armlab.diagnosis.report.html import bullets, figures, html_document, html_table, paragraph, section
from armlab.effects.library import effect_named

SHOWN_S = 20.0  # of the longest held-out run, in the figures


def motion_page(diagnosis: MotionDiagnosis, command: str) -> str:
    """HTML text of the page. command: that repeats the diagnosis."""
    name = diagnosis.recording.name
    parts = [
        f"<h1>Diagnosis of {escape(name)}: motion only</h1>",
        paragraph(summary_of(diagnosis), f"verdict {diagnosis.status}"),
    ]
    if diagnosis.servos is not None:
        parts += [_errors(diagnosis), _findings(diagnosis), _numbers(diagnosis), _files(diagnosis)]
    parts.append(section("origin", "How to repeat this", paragraph(command, "pale")))
    return html_document(f"Diagnosis of {name}", parts)


def _errors(diagnosis: MotionDiagnosis) -> str:
    rows = [
        (
            str(each.joint),
            f"{1e3 * each.command:.3g}",
            "" if each.replay_before is None else f"{1e3 * each.replay_before:.3g}",
            f"{1e3 * each.replay_after:.3g}",
        )
        for each in diagnosis.errors
    ]
    before, after = diagnosis.tool
    tool = "" if before is None else f" At the tool: {1e3 * before:.3g} mm before, {1e3 * after:.3g} mm after."
    table = html_table(("joint", "command itself", "simulation as given", "with what was found"), rows)
    words = "Root mean square of simulated minus measured position over the held-out runs, mrad; whole runs, closed "
    words += f"loop, from the measured first state.{tool}"
    return section("replay", "Held-out runs, replayed", paragraph(words), table, figures(_pictures(diagnosis)))


def _pictures(diagnosis: MotionDiagnosis) -> list[str]:
    """One figure a joint: a stretch of a held-out run in which it moves most."""
    made = []
    for row, joint in enumerate(diagnosis.simulation.joints):
        after = max(diagnosis.replayed_after, key=lambda each: float(np.ptp(each.run.position[:, row])))
        run = after.run
        centre = run.time[int(np.argmax(np.abs(np.gradient(run.position[:, row]))))]
        chosen = np.abs(run.time - centre) < SHOWN_S / 2
        time = run.time[chosen]
        layers: list[Layer] = [Line(time, run.position[chosen, row], MEASURED_LOOK)]
        for before in diagnosis.replayed_before:
            if before.run is run:
                layers.append(Line(time, before.position[chosen, row], GIVEN_LOOK))
        layers.append(Line(time, after.position[chosen, row], FOUND_LOOK))
        name = diagnosis.simulation.arm.joints[joint].name
        shown = [layer.y for layer in layers if isinstance(layer, Line)]
        x, y = fit_axis("time, s", time), fit_axis("position, rad", *shown)
        made.append(draw_chart(f"joint {row + 1}, {name}: {run.name}", x, y, layers))
    return made


def _findings(diagnosis: MotionDiagnosis) -> str:
    lines = [finding_phrase(each) for each in diagnosis.findings]
    steps = {
        each.parameter.experiment or effect_named(each.effect).experiment for each in diagnosis.findings if each.rivals
    }
    next_steps = ("<h3>Next recording</h3>", bullets(sorted(step for step in steps if step))) if any(steps) else ()
    return section("findings", "What the simulation has wrong", bullets(lines or ["nothing"]), *next_steps)


def _numbers(diagnosis: MotionDiagnosis) -> str:
    """All numbers of all joints beside those of the simulation, with intervals where they were fitted."""
    rows = []
    for row, chosen in enumerate(diagnosis.chosen):
        if chosen is None:
            continue
        low, high = chosen.fit.interval()
        for place, parameter in enumerate(PARAMETERS):
            value, nominal = float(chosen.fit.values[place]), float(chosen.nominal[place])
            if not chosen.fit.free[place]:
                continue
            given = "unknown" if np.isnan(nominal) else "none" if nominal >= INFINITE_LIMIT else f"{nominal:.4g}"
            interval = f"{low[place]:.4g} to {high[place]:.4g}"
            rows.append((str(row + 1), parameter.key, given, f"{value:.4g}", interval, parameter.unit))
    table = html_table(("joint", "number", "simulation", "found", "95 % interval", "unit"), rows, texts=(1, 5))
    return section("numbers", "All fitted numbers", table)


def _files(diagnosis: MotionDiagnosis) -> str:
    assert diagnosis.servos is not None
    words = (
        "simulation.xml is the simulation with these numbers, as MJCF for MuJoCo; robot.urdf and controllers.yaml are "
    )
    words += "for ROS 2, isaaclab_actuators.py for Isaac Lab, mjlab_actuators.py for mjlab; each says what it does not "
    words += "hold. servo_plugin.py adds the rest to a simulation in MuJoCo. What MJCF has no field for:"
    missing = list(lines_without_field(diagnosis.simulation, diagnosis.servos)) or ["nothing"]
    return section("files", "The simulation with these numbers", paragraph(words), bullets(missing))
