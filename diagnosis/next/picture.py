"""One picture of a design: the rivals' difference against the noise before and after, how clear it is, the motion."""

from dataclasses import dataclass
from io import BytesIO

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from diagnosis.next.design import random_point
from diagnosis.next.difference import difference
from diagnosis.next.experiment import WEAK, Experiment, Pair
from diagnosis.next.sampling import kept_columns
from recordings.run import Array

SIZE = (11.0, 6.6)  # inches
BEFORE, AFTER, NOISE = "#B87800", "#0072B2", "#C9CED4"  # told apart with any colour vision
JOINTS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000")


@dataclass(frozen=True, eq=False)
class _Seen:
    """A motion at its kept rows, and the torque (rows, joints) by which the rivals differ on it."""

    title: str
    time: Array
    torque: Array


def picture(experiment: Experiment) -> bytes:
    """PNG of the pair that is hardest to tell, its difference before and after, how clear it is, and the motion."""
    pair = min((each for each in experiment.pairs if not each.hopeless), key=lambda each: each.after)
    with matplotlib.rc_context({"font.size": 9, "axes.grid": True, "grid.alpha": 0.3, "legend.frameon": False}):
        figure = Figure(figsize=SIZE, layout="constrained")
        axes = figure.subplots(2, 2)
        _fill(axes.ravel().tolist(), experiment, pair)
        figure.suptitle(_headline(experiment, pair), fontsize=11, fontweight="bold")
        buffer = BytesIO()
        figure.savefig(buffer, format="png", dpi=130, metadata={"Software": None})
    return buffer.getvalue()


def _headline(experiment: Experiment, pair: Pair) -> str:
    found = experiment.chances[pair.question]
    told = "" if found is None else f"\none run of this motion decides rightly with probability {found.right:.2f}"
    return f"{pair.names[0]} or {pair.names[1]}?{told}"


def _fill(axes: list[Axes], experiment: Experiment, pair: Pair) -> None:
    designed, other = _designed(experiment, pair), _other(experiment, pair)
    joint = int(np.argmax(np.sum(designed.torque**2, axis=0)))
    drive = "force" if experiment.excitation.arm.joints[joint].kind == "prismatic" else "torque"
    unit = "N" if drive == "force" else "N m"
    level = float(experiment.prepared.sampling.noise.level[joint])
    top = max(1.3 * level, *(1.1 * float(np.abs(each.torque[:, joint]).max()) for each in (designed, other)))
    for axis, seen, color in zip(axes, (other, designed), (BEFORE, AFTER), strict=False):
        axis.axhspan(-level, level, color=NOISE, alpha=0.6, label="noise of a sample")
        axis.plot(seen.time, seen.torque[:, joint], color=color, linewidth=1.1, label="difference of the rivals")
        axis.set(title=seen.title, ylim=(-top, top), xlabel="time, s", ylabel=f"{drive} of joint {joint + 1}, {unit}")
        axis.legend(loc="upper right", fontsize=8)
    _errors(axes[2], pair)
    _moved(axes[3], experiment)


def _errors(axis: Axes, pair: Pair) -> None:
    """Standard errors between the rivals with each kind of second motion."""
    bars = {"this motion": pair.after, "a random motion": pair.random, "first recording alone": pair.before}
    axis.barh(list(bars), list(bars.values()), color=[AFTER, "0.6", BEFORE], height=0.6)
    for place, value in enumerate(bars.values()):
        axis.text(value, place, f" {value:.1f}", va="center")
    axis.axvline(WEAK, color="0.2", linestyle="dashed", linewidth=1.0)
    axis.text(WEAK, -0.45, f" {WEAK:g}: clear", fontsize=8)
    axis.set(xlim=(0, 1.15 * max(*bars.values(), WEAK)), title="how far the rivals are apart")
    axis.set(xlabel="standard errors")


def _moved(axis: Axes, experiment: Experiment) -> None:
    problem, point = experiment.problem, experiment.point
    if problem is None or point is None:
        return
    motion = problem.trajectory.motions(point[None], problem.times).motion
    for number, joint in enumerate(problem.arm.joints):
        axis.plot(problem.times, motion.position[0, :, number], color=JOINTS[number % len(JOINTS)], label=joint.name)
    units = {"prismatic": "m"}
    told = dict.fromkeys(units.get(joint.kind, "rad") for joint in problem.arm.joints)
    axis.set(title="the motion to record", xlabel="time, s", ylabel=f"joint position, {' or '.join(told)}")
    axis.legend(loc="upper right", fontsize=8, ncols=3)


def _designed(experiment: Experiment, pair: Pair) -> _Seen:
    problem, point = experiment.problem, experiment.point
    if problem is None or point is None:
        raise ValueError("there is no motion to draw")
    return _seen(experiment, pair, point, "after: on the designed motion")


def _other(experiment: Experiment, pair: Pair) -> _Seen:
    """The first recording; a random motion of the same limits where there is none."""
    first = experiment.prepared.first
    if first is None:
        return _seen(experiment, pair, random_point(experiment.excitation, experiment.budget), "on a random motion")
    prepared = experiment.prepared
    gram = prepared.before.gram + prepared.layout.prior
    columns = first.columns(prepared.layout)
    torque = difference(prepared.questions[pair.question], pair.places, gram, columns)
    time = np.arange(len(columns)) / prepared.sampling.kept_hz
    return _Seen("before: on the first recording", time, torque)


def _seen(experiment: Experiment, pair: Pair, point: Array, title: str) -> _Seen:
    prepared, question = experiment.prepared, experiment.prepared.questions[pair.question]
    times = prepared.sampling.times(experiment.budget.duration)
    motion = experiment.excitation.trajectory.motions(point[None], times).motion.select(np.intp(0))
    scene = prepared.present.scene(motion, times)
    gram = prepared.together(prepared.moments(scene).gram)
    keep = prepared.sampling.filter(len(times))
    columns = kept_columns(prepared.layout.base, prepared.layout.candidates, scene, keep, smooth=True)
    return _Seen(title, times[keep.rows], difference(question, pair.places, gram, columns))
