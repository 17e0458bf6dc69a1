"""The card of a designed experiment as lines, as JSON (schema next/1), and as a picture."""

from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armlab.common.arrays import Array
from armlab.common.report import palette
from armlab.common.report.palette import figure_style, series_style
from armlab.diagnosis.next.decision import Chances
from armlab.diagnosis.next.experiment import Experiment, RivalPair
from armlab.diagnosis.next.moments import solve_least_squares, unexplained_power
from armlab.diagnosis.next.motion import random_point
from armlab.diagnosis.next.question import CLEAR_SEPARATION, Question
from armlab.diagnosis.next.sampling import kept_columns, noise_levels
from problem.joint_words import joint_in_words

CARD_SCHEMA = "next/1"


def card_lines(experiment: Experiment) -> Iterator[str]:
    """The card as lines for the terminal."""
    yield "all usual friction is fitted beside; a diagnosis does so only where it pays, and may decide sooner:"
    yield "standard errors between rivals           before   random motion   this motion"
    for pair in experiment.pairs:
        yield f"  {pair.names[0]} | {pair.names[1]}"
        if pair.hopeless:
            yield "    no motion separates these two: to this arm's torques they are the same"
        else:
            yield f"    {pair.before:41.1f} {pair.random:15.1f} {pair.after:13.1f}"
            if pair.after < CLEAR_SEPARATION:
                yield f"    {runs_needed(pair)} such runs would bring {CLEAR_SEPARATION:g} standard errors"
        for remedy in pair.remedies:
            yield f"    what else would: {remedy.what}: {remedy.separation:.1f} standard errors"
    for number, chances in enumerate(experiment.chances):
        if chances is not None:
            yield _chances_line(chances, experiment, number)
    if experiment.safety is not None:
        yield from experiment.safety.lines()
    budget = experiment.budget
    yield f"designed in {experiment.seconds:.1f} s with {budget.evaluations} evaluations of {budget.algorithm}"


def runs_needed(pair: RivalPair) -> int:
    """Number of runs of the designed motion that separate a pair clearly: the information of runs adds."""
    gain = pair.after**2 - pair.before**2
    return int(np.ceil((CLEAR_SEPARATION**2 - pair.before**2) / gain)) if gain > 0 else 0


def _chances_line(chances: Chances, experiment: Experiment, number: int) -> str:
    names = " or ".join(str(rival.name) for rival in experiment.prepared.questions[number].rivals)
    return (
        f"one such run decides between {names}: rightly {100 * chances.right:.0f} %, "
        f"wrongly {100 * chances.wrong:.0f} %, still open {100 * chances.open:.0f} % of simulated runs"
    )


def card_content(experiment: Experiment) -> dict[str, Any]:
    """The card as plain data, schema next/1."""
    budget = experiment.budget
    return {
        "schema": CARD_SCHEMA,
        "helps": experiment.point is not None,
        "duration_s": budget.duration,
        "algorithm": budget.algorithm,
        "evaluations": budget.evaluations,
        "seed": budget.seed,
        "seconds": round(experiment.seconds, 2),
        "limits": [_limits_content(each) for each in experiment.excitation.constraints.limits],
        "safety": None if experiment.safety is None else experiment.safety.content(),
        "questions": [_question_content(experiment, number) for number in range(len(experiment.chances))],
    }


def _question_content(experiment: Experiment, number: int) -> dict[str, Any]:
    chances = experiment.chances[number]
    rivals = experiment.prepared.questions[number].rivals
    decides = None
    if chances is not None:
        decides = {"rightly": chances.right, "wrongly": chances.wrong, "open": chances.open}
    return {
        "rivals": [
            {
                "effect": each.name.effect,
                "joint": each.name.joint,
                "law": each.laws[0].candidate.equation(each.values),
            }
            for each in rivals
        ],
        "pairs": [_pair_content(each) for each in experiment.pairs if each.question == number],
        "decides": decides,
    }


def _pair_content(pair: RivalPair) -> dict[str, Any]:
    return {
        "names": list(pair.names),
        "no_motion_separates": pair.hopeless,
        "standard_errors": {"before": pair.before, "random_motion": pair.random, "designed": pair.after},
        "otherwise": [{"what": each.what, "standard_errors": each.separation} for each in pair.remedies],
    }


def _limits_content(limits: Any) -> dict[str, Any]:
    torque = limits.torque if np.isfinite(limits.torque) else None
    return {
        "position": list(limits.position),
        "velocity": limits.velocity,
        "acceleration": limits.acceleration,
        "torque": torque,
    }


def torque_difference(question: Question, pair: tuple[int, int], gram: Array, columns: Array) -> Array:
    """Torque (rows, joints), N m, of the rival that is harder to refute, less the best fit of the other one.

    gram: of everything that is fitted. columns: (rows, joints, columns), of the motion that is drawn.
    """
    directions = [each for each in (pair, pair[::-1]) if not question.inseparable[each]] or [pair]
    one, other = min(directions, key=lambda each: question.noncentrality(gram, *each))
    right = question.rivals[one]
    right_columns = right.laws[0].columns
    fits = [np.append(question.free, law.columns) for law in question.rivals[other].laws]
    chosen = min(fits, key=lambda each: unexplained_power(gram, right_columns, right.values, each))
    best = solve_least_squares(gram, chosen, gram[:, right_columns] @ right.values)
    return np.asarray(columns[:, :, right_columns] @ right.values - columns[:, :, chosen] @ best)


FIGURE_SIZE = (11.0, 6.6)  # inches
BEFORE_COLOR, AFTER_COLOR, NOISE_COLOR = palette.BEFORE, palette.AFTER, palette.NOISE


@dataclass(frozen=True, eq=False)
class _MotionDifference:
    """A motion at its kept rows, and the torque (rows, joints) by which the rivals differ on it."""

    title: str
    time: Array
    torque: Array


def draw_card(experiment: Experiment) -> bytes:
    """PNG of the pair that is hardest to tell, its difference before and after, how clear it is, and the motion."""
    pair = min((each for each in experiment.pairs if not each.hopeless), key=lambda each: each.after)
    with figure_style():
        figure = Figure(figsize=FIGURE_SIZE, layout="constrained")
        axes = figure.subplots(2, 2)
        _fill_panels(axes.ravel().tolist(), experiment, pair)
        figure.suptitle(_headline(experiment, pair), fontsize=11, fontweight="bold")
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=130, metadata={"Software": None})
    return buffer.getvalue()


def _headline(experiment: Experiment, pair: RivalPair) -> str:
    chances = experiment.chances[pair.question]
    question = f"{pair.names[0]} or {pair.names[1]}?"
    if chances is None:
        return question
    return f"{question}\none run of this motion decides rightly with probability {chances.right:.2f}"


def _fill_panels(axes: list[Axes], experiment: Experiment, pair: RivalPair) -> None:
    designed, other = _difference_on_design(experiment, pair), _difference_on_reference(experiment, pair)
    joint = int(np.argmax(np.sum(designed.torque**2, axis=0)))
    drive = "force" if experiment.excitation.arm.joints[joint].kind == "prismatic" else "torque"
    unit = "N" if drive == "force" else "N m"
    level = float(noise_levels(experiment.prepared.sampling.noise)[joint])
    top = max(1.3 * level, *(1.1 * float(np.abs(each.torque[:, joint]).max()) for each in (designed, other)))
    for axis, difference, color in zip(axes, (other, designed), (BEFORE_COLOR, AFTER_COLOR), strict=False):
        axis.axhspan(-level, level, color=NOISE_COLOR, alpha=0.6, label="noise of a sample")
        axis.plot(
            difference.time, difference.torque[:, joint], color=color, linewidth=1.1, label="difference of the rivals"
        )
        axis.set(
            title=difference.title,
            ylim=(-top, top),
            xlabel="time, s",
            ylabel=f"{drive} of {joint_in_words(experiment.excitation.arm, joint + 1)}, {unit}",
        )
        axis.legend(loc="upper right", fontsize=8)
    _draw_separations(axes[2], pair)
    _draw_motion(axes[3], experiment)


def _draw_separations(axis: Axes, pair: RivalPair) -> None:
    """Standard errors between the rivals with each kind of second motion."""
    bars = {"this motion": pair.after, "a random motion": pair.random, "first recording alone": pair.before}
    axis.barh(list(bars), list(bars.values()), color=[AFTER_COLOR, palette.MIDDLE, BEFORE_COLOR], height=0.6)
    for place, value in enumerate(bars.values()):
        axis.text(value, place, f" {value:.1f}", va="center")
    axis.axvline(CLEAR_SEPARATION, color=palette.INK, linestyle="dashed", linewidth=1.0)
    axis.text(CLEAR_SEPARATION, -0.45, f" {CLEAR_SEPARATION:g}: clear", fontsize=8)
    axis.set(xlim=(0, 1.15 * max(*bars.values(), CLEAR_SEPARATION)), title="how far the rivals are apart")
    axis.set(xlabel="standard errors")


def _draw_motion(axis: Axes, experiment: Experiment) -> None:
    problem, point = experiment.problem, experiment.point
    if problem is None or point is None:
        return
    motion = problem.trajectory.motions(point[None], problem.times).motion
    for number, joint in enumerate(problem.arm.joints):
        axis.plot(
            problem.times,
            motion.position[0, :, number],
            color=series_style(number).color,
            label=joint.name,
        )
    units = dict.fromkeys("m" if joint.kind == "prismatic" else "rad" for joint in problem.arm.joints)
    axis.set(title="the motion to record", xlabel="time, s", ylabel=f"joint position, {' or '.join(units)}")
    axis.legend(loc="upper right", fontsize=8, ncols=3)


def _difference_on_design(experiment: Experiment, pair: RivalPair) -> _MotionDifference:
    problem, point = experiment.problem, experiment.point
    if problem is None or point is None:
        raise ValueError("there is no motion to draw")
    return _difference_on_motion(experiment, pair, point, "after: on the designed motion")


def _difference_on_reference(experiment: Experiment, pair: RivalPair) -> _MotionDifference:
    """The first recording; a random motion of the same limits where there is none."""
    first = experiment.prepared.first
    if first is None:
        return _difference_on_motion(
            experiment, pair, random_point(experiment.excitation, experiment.budget), "on a random motion"
        )
    prepared = experiment.prepared
    gram = prepared.before.gram + prepared.layout.prior
    columns = first.columns(prepared.layout)
    torque = torque_difference(prepared.questions[pair.question], pair.places, gram, columns)
    time = np.arange(len(columns)) / prepared.sampling.kept_hz
    return _MotionDifference("before: on the first recording", time, torque)


def _difference_on_motion(experiment: Experiment, pair: RivalPair, point: Array, title: str) -> _MotionDifference:
    prepared, question = experiment.prepared, experiment.prepared.questions[pair.question]
    times = prepared.sampling.times(experiment.budget.duration)
    motion = experiment.excitation.trajectory.motions(point[None], times).motion.select(np.intp(0))
    scene = prepared.present.scene(motion, times)
    gram = prepared.total_gram(prepared.moments(scene).gram)
    keep = prepared.sampling.filter(len(times))
    columns = kept_columns(prepared.layout.base, prepared.layout.candidates, scene, keep, smooth=True)
    return _MotionDifference(title, times[keep.rows], torque_difference(question, pair.places, gram, columns))
