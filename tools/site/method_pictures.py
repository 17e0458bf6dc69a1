"""A picture for each page of methods: drawn here, taken from a diagnosis of the example log, or a committed result."""

import contextlib
import io
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.signal import lsim

from armlab.effects.library import family_named
from bench.figures import line_style, render_figure
from problem.regressor import rigid_body_torque
from tools.site.examples import Step, run_step
from tools.site.gallery import EXAMPLES, fitted_example, gallery_scene
from tools.site.pages import Pages

ROOT = Path(__file__).parents[2]
LOG = Path("log/run-1.csv")
COMMANDS = (
    "armlab recording example log",
    "armlab recording import log/run-1.csv log/run-2.csv --robot log/robot.yaml --validate log/run-2.csv --out rec",
    "armlab diagnose rec --out verdict",
)
SHOWN_S = 3.0  # of a motion


@dataclass(frozen=True)
class Picture:
    """words: what it shows, a sentence. source: a file of the example, one of the repository, or what draws on axes."""

    words: str
    source: str | Callable[[Axes], None]


def method_pictures() -> Pages:
    """SVG of each page by its path."""
    with tempfile.TemporaryDirectory() as folder, contextlib.chdir(folder), contextlib.redirect_stderr(io.StringIO()):
        for command in COMMANDS:
            run_step(Step("command", command))
        return {f"pictures/methods/{page}.svg": _svg(picture) for page, picture in PICTURES.items()}


def with_picture(page: str, text: str) -> str:
    """The text of a page of methods with its picture below the title."""
    if page not in PICTURES:
        return text
    title, _, rest = text.partition("\n")
    words = PICTURES[page].words
    return f"{title}\n\n![{words}](pictures/methods/{page}.svg)\n\n*{words}*\n{rest}"


def _svg(picture: Picture) -> bytes:
    if callable(picture.source):
        draw = picture.source

        def fill(figure: Figure) -> None:
            axes = figure.subplots()
            draw(axes)
            figure.legend(loc="outside upper center", ncols=3)

        return render_figure((7.2, 2.8), fill, ("svg",))["svg"]
    own = Path(picture.source)
    return (own if own.is_file() else ROOT / own).read_bytes()


def _line(axes: Axes, place: int, along: object, values: object, label: str) -> None:
    axes.plot(along, values, color=line_style(place).color, linewidth=1.2, label=label)


def draw_recording(axes: Axes) -> None:
    """Position and torque of a joint, as recorded."""
    log = pd.read_csv(LOG)
    time = (log["timestamp_ns"] - log["timestamp_ns"][0]) / 1e9
    shown = time < SHOWN_S
    _line(axes, 1, time[shown], log["tau2_Nm"][shown], "torque (N m)")
    _line(axes, 0, time[shown], 10 * log["q2_rad"][shown], "position (0.1 rad)")
    axes.set_xlabel("time (s)")


def draw_steps(axes: Axes) -> None:
    """Steps between the stamps of a log with a gap, a stamp twice and a backward step."""
    stamps = np.arange(400) * 0.002
    stamps[150:] += 0.02
    stamps[250], stamps[320] = stamps[249], stamps[318]
    _line(axes, 0, np.arange(1, 400), 1000 * np.diff(stamps), "gap, the same stamp twice, backward step")
    axes.set(xlabel="row", ylabel="step (ms)")


def draw_reading(axes: Axes) -> None:
    """Torque of a joint by the robot file, and as recorded with the sign turned."""
    scene = gallery_scene()
    model = rigid_body_torque(scene.arm, scene.motion)[:, 1]
    shown = scene.time < SHOWN_S
    _line(axes, 0, scene.time[shown], model[shown], "by the robot file")
    _line(axes, 1, scene.time[shown], -scene.torque[shown, 1], "recorded, sign turned")
    _line(axes, 2, scene.time[shown], scene.torque[shown, 1], "recorded, as it is to be read")
    axes.set(xlabel="time (s)", ylabel="torque (N m)")


def draw_change(axes: Axes) -> None:
    """Friction of a joint in an old and a new recording."""
    scene = gallery_scene()
    order = np.argsort(scene.motion.velocity[:, 1])
    velocity = scene.motion.velocity[order, 1]
    for place, (label, factor) in enumerate({"old recording": 1.0, "new recording": 1.4}.items()):
        friction = sum(
            fitted_example(family_named(name).facts, EXAMPLES[name]).torque(scene)[order, 1]
            for name in ("coulomb_friction", "viscous_friction")
        )
        _line(axes, place, velocity, factor * friction, label)
    axes.set(xlabel="velocity (rad/s)", ylabel="friction (N m)")


def draw_servo(axes: Axes) -> None:
    """A servo of 4 Hz that answers its command 39 ms late, and the simulation without the delay."""
    time = np.arange(0, SHOWN_S, 0.002)
    command = np.sin(2 * np.pi * 0.7 * np.maximum(time - 0.3, 0))
    natural = 2 * np.pi * 4
    late_command = np.interp(time - 0.039, time, command)
    servo = ([natural**2], [1.0, 1.4 * natural, natural**2])
    _line(axes, 3, time, command, "command")
    _line(axes, 0, time, lsim(servo, late_command, time)[1], "measured")
    _line(axes, 1, time, lsim(servo, command, time)[1], "simulated")
    axes.set(xlabel="time (s)", ylabel="position (rad)")


def draw_rivals(axes: Axes) -> None:
    """Two effects that a motion hardly tells apart."""
    scene = gallery_scene()
    shown = scene.time < SHOWN_S
    for place, name in enumerate(("coulomb_friction", "stribeck_friction")):
        facts = family_named(name).facts
        torque = fitted_example(facts, EXAMPLES[name]).torque(scene)[:, 1]
        _line(axes, place, scene.time[shown], torque[shown] / np.abs(torque).max(), facts.words)
    axes.set(xlabel="time (s)", ylabel="torque, share of the largest")


PICTURES = {
    "recordings": Picture("A recording holds the motion and the torque of each joint.", draw_recording),
    "odd-logs": Picture("Steps between the time stamps of a log with three faults.", draw_steps),
    "reading": Picture("A torque that is read with the wrong sign does not fit the robot file.", draw_reading),
    "identification": Picture(
        "Torque of a joint: measured, and predicted with what was identified.", "verdict/figures/torque_joint2.svg"
    ),
    "diagnosis": Picture(
        "Error of each joint: simulation as given, rigid body refitted, with what was found, and the noise floor.",
        "verdict/figures/errors.svg",
    ),
    "effects": Picture(
        "Friction that the diagnosis of the example log finds, against the data.",
        "verdict/figures/finding2_coulomb_friction.svg",
    ),
    "changes": Picture("A change that a comparison names: friction of one joint has grown by 40 %.", draw_change),
    "motion": Picture("Without torque, a delay shows in the motion alone.", draw_servo),
    "next-experiment": Picture(
        "Two rivals that this motion hardly tells apart: another motion is needed.", draw_rivals
    ),
    "proof": Picture(
        "Something known is concealed in real recordings: what the diagnosis makes of it, by size.",
        "results/proof/real/strength.svg",
    ),
    "running": Picture("The figure that a run draws: convergence of each algorithm.", "docs/pictures/convergence.svg"),
    "which-optimiser": Picture("Problems of the suites by their properties.", "results/landscape/landscape.svg"),
    "problem": Picture("An excitation trajectory in joint space.", "results/paper/figure5.svg"),
    "algorithms": Picture("Average convergence of the paper's six algorithms.", "results/paper/figure3.svg"),
    "comparing": Picture("Ranks over the problems of a suite, and who differs.", "results/suite/suite_ranking.svg"),
}
