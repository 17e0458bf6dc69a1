"""The page of a motion-only verdict: findings, errors before and after, one figure a joint, what the files hold."""

import numpy as np

from armlab.common.report.charts import FOUND_LOOK, GIVEN_LOOK, MEASURED_LOOK, Chart, Layer, Line, draw_chart, fit_axis
from armlab.common.report.page import Table, render_page
from armlab.common.report.wording import format_unit, join_words
from armlab.diagnosis.motion.export import lines_without_field
from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ServoFinding
from armlab.diagnosis.motion.servo import INFINITE_LIMIT, PARAMETERS
from armlab.effects.library import effect_named
from armlab.report.account.next_steps import MAX_STEPS
from armlab.report.motion.motion_words import (
    current_phrase,
    finding_phrases,
    remarks,
    stated_with_numbers,
    summary_of,
    untold_numbers,
)
from armlab.report.motion.stated_numbers import stated_numbers
from armlab.report.words import format_chance, name_of_effect
from problem.joint_words import joint_at_start, joint_in_table, joints_in_words

USE = (
    "Take the simulation with these numbers: `simulation.xml` as MJCF for MuJoCo; `robot.urdf` and `controllers.yaml` "
    "for ROS 2, `isaaclab_actuators.py` for Isaac Lab, `mjlab_actuators.py` for mjlab. Each says what it does not "
    "hold; `servo_plugin.py` adds the rest to a simulation in MuJoCo."
)
SHOWN_S = 20.0  # of the longest held-out run, in the figures


def motion_page(diagnosis: MotionDiagnosis, command: str) -> str:
    """HTML text of the page. command: that repeats the diagnosis."""
    known = diagnosis.servos is not None
    first, _, rest = summary_of(diagnosis).partition(". ")
    rest = " ".join([rest, *remarks(diagnosis)]).strip()
    charts = position_charts(diagnosis).values() if known else ()
    pictures = [draw_chart(each.title, each.x, each.y, each.layers) for each in charts]
    shown = _most_telling_row(diagnosis) if known else 0
    return render_page(
        __package__,
        "motion.html",
        f"Diagnosis of {diagnosis.recording.name}: motion only",
        status=diagnosis.status,
        verdict=(first.removesuffix(".") + ".", rest),
        known=known,
        joints=joint_table(diagnosis) if known else None,
        steps=_next_recordings(diagnosis),
        uses=[USE] if known else [],
        errors=_error_table(diagnosis) if known else None,
        tool=_tool_text(diagnosis),
        replayed=pictures[shown : shown + 1],
        pictures=[*pictures[:shown], *pictures[shown + 1 :]],
        findings=[*finding_phrases(diagnosis, minor=False), *finding_phrases(diagnosis, minor=True)],
        currents=[current_phrase(diagnosis.simulation.arm, each) for each in diagnosis.currents],
        numbers=_number_table(diagnosis) if known else None,
        untold=untold_table(diagnosis),
        missing=_missing_fields(diagnosis),
        command=command,
    )


def joint_table(diagnosis: MotionDiagnosis) -> Table:
    """What is wrong with the servo of each joint, with its interval, how sure, and the replay error before → after."""
    rows, arm = [], diagnosis.simulation.arm
    for each in diagnosis.errors:
        stated = [one for one in stated_numbers(diagnosis) if not one.minor]
        own = [one for one in stated if one.finding.joint == each.joint]
        words = "; ".join(stated_with_numbers(one) for one in own)
        sure = "; ".join(format_chance(one.statement.probability) for one in own)
        before = "" if each.replay_before is None else f"{1e3 * each.replay_before:.3g} → "
        errors = f"{before}{1e3 * each.replay_after:.3g} mrad"
        rows.append((joint_in_table(arm, each.joint), words, sure, errors))
    headings = ("joint", "what is wrong, 95 % interval", "how sure", "replay error")
    return Table(headings, rows, (1, 2), stacked=True)


def untold_table(diagnosis: MotionDiagnosis) -> Table:
    """Of each joint, the fitted numbers that its motion does not tell from other effects."""
    rows = [
        (joint_in_table(diagnosis.simulation.arm, diagnosis.simulation.number_of(row)), *line)
        for row, rivals in enumerate(diagnosis.rivals)
        for line in untold_numbers(rivals)
    ]
    return Table(("joint", "fitted number", "this motion does not tell it from"), rows, (1, 2), stacked=True)


def _next_recordings(diagnosis: MotionDiagnosis) -> list[str]:
    """Recordings that separate the findings from their rivals, each with what it tells and the joints of these."""
    steps: dict[str, list[ServoFinding]] = {}
    for each in sorted(stated_numbers(diagnosis), key=lambda each: -each.share):
        step = each.finding.parameter.experiment or effect_named(each.finding.effect).experiment
        if each.finding.rivals and not each.minor and step:
            steps.setdefault(step, []).append(each.finding)
    arm, out = diagnosis.simulation.arm, list[str]()
    for step, own in steps.items():
        names = dict.fromkeys(name_of_effect(each) for one in own for each in (one.effect, *one.rivals))
        first, *others = names
        place = joints_in_words(arm, sorted({each.joint for each in own}))
        out.append(f"To tell {first} from {join_words(others, 'or')}: {step} ({place}).")
    return out[:MAX_STEPS]


def _error_table(diagnosis: MotionDiagnosis) -> Table:
    rows = [
        (
            joint_in_table(diagnosis.simulation.arm, each.joint),
            f"{1e3 * each.command:.3g}",
            "–" if each.replay_before is None else f"{1e3 * each.replay_before:.3g}",
            f"{1e3 * each.replay_after:.3g}",
        )
        for each in diagnosis.errors
    ]
    return Table(("joint", "command itself", "simulation as given", "with what was found"), rows, stacked=True)


def _tool_text(diagnosis: MotionDiagnosis) -> str:
    if diagnosis.servos is None:
        return ""
    before, after = diagnosis.tool
    return "" if before is None else f"At the end of the arm: {1e3 * before:.3g} mm before, {1e3 * after:.3g} mm after."


def _most_telling_row(diagnosis: MotionDiagnosis) -> int:
    """The row of the joint whose replay error over held-out runs falls most, or is largest."""
    falls = [(each.replay_before or 2 * each.replay_after) - each.replay_after for each in diagnosis.errors]
    return int(np.argmax(falls)) if falls else 0


def position_charts(diagnosis: MotionDiagnosis) -> dict[int, Chart]:
    """By the number of the joint, from 1: its position, measured and replayed, where it moves most in held-out runs."""
    made = {}
    for row in range(len(diagnosis.simulation.joints)):
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
        shown = [layer.y for layer in layers if isinstance(layer, Line)]
        x, y = fit_axis("time, s", time), fit_axis("position, rad", *shown)
        number = diagnosis.simulation.number_of(row)
        made[number] = Chart(f"{joint_at_start(diagnosis.simulation.arm, number)}: {run.name}", x, y, layers)
    return made


def _number_table(diagnosis: MotionDiagnosis) -> Table:
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
            joint = joint_in_table(diagnosis.simulation.arm, diagnosis.simulation.number_of(row))
            rows.append((joint, parameter.key, given, f"{value:.4g}", interval, format_unit(parameter.unit)))
    headings = ("joint", "number", "simulation", "found", "95 % interval", "unit")
    return Table(headings, rows, (1, 5), stacked=True)


def _missing_fields(diagnosis: MotionDiagnosis) -> list[str]:
    """What of the servos MJCF has no field for."""
    return [] if diagnosis.servos is None else list(lines_without_field(diagnosis.simulation, diagnosis.servos))
