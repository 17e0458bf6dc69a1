"""The gallery: a page an effect with its law, its torque on one motion, what imitates it there, and an example.

The torque is computed by the effect's own code, from the parameters of `EXAMPLES`.
"""

import re
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import numpy as np
import yaml
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from armlab.common.arrays import Array
from armlab.common.markdown import markdown_page, markdown_table
from armlab.common.streams import named_generator
from armlab.diagnosis.next.confusability import Card, PlannedMotion, confusability_card
from armlab.effects.contact import EXTERNAL_CONTACT_FACTS, Contact
from armlab.effects.contract import Effect, Scene, Value
from armlab.effects.example import random_motion
from armlab.effects.library import BUILT_IN, family_named
from armlab.effects.model import FittedEffect
from armlab.effects.servo import SERVO_EFFECTS
from bench.figures import line_style, render_figure
from problem.regressor import rigid_body_torque
from problem.robot_file import load_arm
from tools.site.pages import Pages, toctree

ROOT = Path(__file__).parents[2]
ARM_NAME, RATE_HZ, DURATION_S = "irb120-arm", 125, 6
FRICTION_LEVEL = 1.0  # N m, in the present model: load friction, gains and delays act on it
SHOWN_RIVALS = 6
AXES = {
    "velocity": "velocity (rad/s)",
    "position": "position (rad)",
    "cycle": "position (rad)",
    "acceleration": "acceleration (rad/s²)",
}


@dataclass(frozen=True)
class Example:
    """Parameters of an effect at a place. joints: joint or link, then the joint of the motion; none: the robot."""

    joints: tuple[int, ...]
    parameters: dict[str, Value]
    form: str = ""
    shown: int = 2  # the joint whose torque is drawn


EXAMPLES = {
    "coulomb_friction": Example((2,), {"level": 2.4}),
    "viscous_friction": Example((2,), {"coefficient": 1.8}),
    "nonlinear_viscous_friction": Example((2,), {"coefficient": 1.6, "exponent": 0.6}),
    "stribeck_friction": Example((2,), {"level": 2.0, "static_level": 3.5, "velocity": 0.15, "exponent": 1.0}),
    "asymmetric_friction": Example((2,), {"positive": 2.8, "negative": 1.6, "exponent": 0.0}, "levels"),
    "load_dependent_friction": Example((2,), {"coefficient": 0.1}),
    "presliding_hysteresis": Example((2,), {"level": 2.0, "stiffness": 60.0}, "Dahl"),
    "friction_drift": Example((2,), {"initial": 2.4, "final": 1.2, "time_constant": 2.0}, "viscous over time"),
    "rotor_inertia": Example((2,), {"inertia": 0.4}),
    "torque_gain_error": Example((2,), {"gain": 1.1}),
    "torque_offset": Example((2,), {"offset": 1.5}),
    "torque_ripple": Example((2,), {"order": 36.0, "amplitude": 0.8, "phase": 0.4}),
    "joint_elasticity": Example((2,), {"stiffness": 900.0, "resonant_stiffness": 900.0}),
    "backlash": Example((2,), {"gap": 0.004, "crossed_gap": 0.004}),
    "joint_coupling": Example((2, 3), {"coefficient": 0.8, "level": 0.6, "inertia": 0.05}),
    "gravity_compensator": Example((2,), {"amplitude": -12.0, "phase": 0.0}, "sine"),
    "cable_stiffness": Example((2,), {"stiffness": 4.0, "rest": 0.3}, "linear"),
    "payload": Example((3,), {"mass": 1.5, "centre": (0.05, 0.0, 0.08)}, "point"),
    "inertial_parameter_error": Example(
        (3,), {"mass": 0.4, "centre": (0.05, 0.0, 0.02), "inertia": (0.004, 0.006, 0.004, 0.0, 0.0, 0.0)}
    ),
    "base_tilt": Example((), {"gravity": (0.5, 0.0, -9.797)}),
    "flexible_base": Example((), {"compliance": 1e-4, "direction": 0.6, "resonance": 12.0, "damping": 0.05}),
    "encoder_offset": Example((2,), {"offset": 0.02}),
    "geometry_error": Example((2,), {"offset": 0.005}, "a"),
    "time_delay": Example((), {"seconds": 0.008}),
    "channel_skew": Example((2,), {"seconds": 0.008}, "torque"),
    "external_contact": Example((2,), {"start": 2.0, "end": 3.0, "peak": 8.0}, "half sine"),
    "torque_saturation": Example((2,), {"limit": 14.0}),
    "friction_curve": Example((2,), {"velocities": (0.0, 0.2, 0.6, 1.2), "torques": (2.0, 2.6, 3.0, 3.1)}),
    "early_friction": Example((2,), {"impulse": 0.05, "lead": 0.01}),
}


def gallery_pages() -> Pages:
    """Path and content of each page and picture of the gallery."""
    pages: Pages = {}
    for family in BUILT_IN:
        facts = family.facts
        pages[f"gallery/{facts.id}.svg"] = draw_torque(facts, EXAMPLES[facts.id])
        pages[f"gallery/{facts.id}.md"] = _effect_page(facts)
    for facts in SERVO_EFFECTS:
        pages[f"gallery/{facts.id}.md"] = _servo_page(facts)
    pages["gallery/index.md"] = _index_page()
    return pages


@cache
def gallery_scene() -> Scene:
    """The motion of all pictures: a Fourier series a joint; Coulomb friction is in the present model."""
    arm = load_arm(ARM_NAME)
    time = np.arange(DURATION_S * RATE_HZ) / RATE_HZ
    motion = random_motion(arm, time, named_generator("gallery"))
    torque = rigid_body_torque(arm, motion) + FRICTION_LEVEL * np.sign(motion.velocity)
    return Scene("gallery", time, motion, arm, arm.parameters, torque)


@cache
def gallery_card() -> Card:
    """Which effects this motion cannot tell apart."""
    scene = gallery_scene()
    return confusability_card(scene.arm, [PlannedMotion("gallery", scene.time, scene.motion)], BUILT_IN)


def fitted_example(facts: Effect, example: Example) -> FittedEffect:
    """The law of the example with its coefficients."""
    if facts is EXTERNAL_CONTACT_FACTS:  # of one run: no model file holds it
        start, end = example.parameters["start"], example.parameters["end"]
        scene = gallery_scene()
        push = Contact.at(scene.arm, example.joints[0], run=scene.run, shape=(start, end))
        return FittedEffect(push, np.array([example.parameters["peak"]]))
    family = family_named(facts.id)
    return FittedEffect(*family.from_parameters(gallery_scene().arm, example.joints, example.parameters, example.form))


def draw_torque(facts: Effect, example: Example) -> bytes:
    """SVG bytes: what the effect adds to the torque of a joint against its variable, and against time."""
    scene, column = gallery_scene(), example.shown - 1
    added = fitted_example(facts, example).torque(scene)[:, column]
    with_axis = facts.axis in AXES

    def fill(figure: Figure) -> None:
        panels = figure.subplots(1, 2 if with_axis else 1, squeeze=False, sharey=True)[0]
        if with_axis:
            _draw_against(panels[0], AXES[facts.axis], _variable(scene, facts, example), added)
        _draw_in_time(panels[-1], scene, added)
        panels[0].set_ylabel(f"torque that it adds to joint {example.shown} (N m)")

    return render_figure((7.6, 3.0), fill, ("svg",))["svg"]


def _variable(scene: Scene, facts: Effect, example: Example) -> Array:
    mover = example.joints[-1] - 1 if example.joints else example.shown - 1
    name = "position" if facts.axis == "cycle" else facts.axis
    return np.asarray(getattr(scene.motion, name)[:, mover])


def _draw_against(axes: Axes, label: str, variable: Array, added: Array) -> None:
    axes.plot(variable, added, color=line_style(0).color, linewidth=1.0)
    axes.set_xlabel(label)


def _draw_in_time(axes: Axes, scene: Scene, added: Array) -> None:
    axes.plot(scene.time, added, color=line_style(1).color, linewidth=1.2)
    axes.set_xlabel("time (s)")


def _effect_page(facts: Effect) -> str:
    example = EXAMPLES[facts.id]
    fitted = fitted_example(facts, example)
    equation = fitted.candidate.equation(fitted.coefficients)
    drawn = f"Torque of the example below at joint {example.shown} of `{ARM_NAME}`, computed by the effect's own code."
    return markdown_page(
        _title(facts),
        _sentence(facts.meaning),
        f"$$\n{facts.law}\n$$",
        f"![torque of {facts.words}]({facts.id}.svg)",
        drawn,
        "## Parameters",
        _parameter_table(facts),
        _law_in_text(facts.id),
        "## What it is confused with",
        *_confusions(facts),
        "## The experiment that tells",
        _sentence(facts.experiment),
        "`armlab next` designs the motion for the rivals of a verdict: [the next experiment](../next-experiment.md).",
        "## Example",
        "A finding says it as an equation:",
        f"```text\n{equation}\n```",
        *_component(facts, example),
    )


def _servo_page(facts: Effect) -> str:
    return markdown_page(
        _title(facts),
        _sentence(facts.meaning),
        f"$$\n{facts.law}\n$$",
        "r is the command. The effect acts on the command of a position servo and has no column of torque; recordings "
        "of motion only show it, by replay: [motion](../motion.md).",
        "## Parameters",
        _parameter_table(facts),
        "## The experiment that tells",
        _sentence(facts.experiment),
    )


def _index_page() -> str:
    parts = ["What a simulation can lack, one page an effect. [The library](../effects.md) has all laws on one page."]
    causes: dict[str, list[Effect]] = {}
    for facts in (*(family.facts for family in BUILT_IN), *SERVO_EFFECTS):
        causes.setdefault(facts.cause, []).append(facts)
    for cause, effects in causes.items():
        parts += [f"## {cause[0].upper()}{cause[1:]}", "\n\n".join(_card(each) for each in effects)]
    ids = [each.id for effects in causes.values() for each in effects]
    return markdown_page("Gallery of effects", *parts, toctree(ids, hidden=True))


def _card(facts: Effect) -> str:
    """A thumbnail, where the effect has a picture, beside its name and what it is."""
    words = f"[{_title(facts)}]({facts.id}.md): {facts.meaning}."
    if facts.id not in EXAMPLES:
        return f":::{{container}} effect-card\n{words}\n:::"
    return f":::{{container}} effect-card\n[![torque of {facts.words}]({facts.id}.svg)]({facts.id}.md)\n\n{words}\n:::"


def _title(facts: Effect) -> str:
    return f"{facts.words[0].upper()}{facts.words[1:]}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _parameter_table(facts: Effect) -> str:
    rows = []
    for each in facts.parameters:
        sizes = each.plausible
        seen = f"{sizes.limits()[0]:g} to {sizes.limits()[1]:g}: {sizes.source}" if sizes else ""
        rows.append((f"`{each.name}`", each.unit_for(), "positive" if each.positive else "", seen))
    return markdown_table(("parameter", "unit", "physics asks", "sizes on arms"), rows)


def _law_in_text(effect: str) -> str:
    """The law as the table of docs/effects.md has it, with the names of all forms."""
    table = (ROOT / "docs" / "effects.md").read_text(encoding="utf-8").split("| effect | law |")[1]
    (cell,) = re.findall(rf"^\| `{effect}` \| (.*?) \| ", table.split("\n\n")[0], re.MULTILINE)
    law = str(cell).replace(r"\|", "|").replace("<", r"\<")
    sign = " (`f` is a smooth sign of the velocity)" if re.search(r"\bf\b", law) else ""
    return f"Written out{sign}: {law}."


def _confusions(facts: Effect) -> list[str]:
    """What the facts say, and what the card of the gallery's motion measures."""
    parts = []
    if facts.contains:
        simpler = ", ".join(_link(name) for name in facts.contains)
        parts.append(f"It contains {simpler}: it is named only where it explains more than they do.")
    if facts.one_of:
        others = [each.facts.id for each in BUILT_IN if each.facts.one_of == facts.one_of and each.facts is not facts]
        parts.append(f"A joint has at most one of it and {', '.join(_link(name) for name in others)}.")
    for one, other in facts.equal_sums:
        parts.append(f"{_link(one)} and {_link(other)} together are this effect exactly, for any motion.")
    rivals = measured_rivals(facts.id)
    if rivals:
        rows = [(_link(name), f"{cosine:.3f}") for name, cosine in rivals]
        parts.append(
            "How similar other effects are to this one on the motion of the picture, if the links are known exactly: "
            "the largest cosine between their torques, over all joints where each can be. At a cosine of 1, no amount "
            "of data from such a motion tells the two apart."
        )
        parts.append(markdown_table(("effect", "cosine"), rows))
    else:
        parts.append("On the motion of the picture, links exactly known, no other effect comes near it.")
    return parts


def measured_rivals(effect: str) -> list[tuple[str, float]]:
    """Other effects by their largest cosine with this one, as the card of the gallery's motion has them."""
    card = gallery_card()
    largest: dict[str, float] = {}
    for entry in card.entries:
        if entry.effect == effect:
            for rival in entry.rivals["nominal"]:
                other = card.entries[rival.index].effect
                largest[other] = max(largest.get(other, 0.0), rival.cosine)
    largest.pop(effect, None)
    return sorted(largest.items(), key=lambda each: -each[1])[:SHOWN_RIVALS]


def _link(effect: str) -> str:
    words = family_named(effect).facts.words
    return f"[{words}]({effect}.md)"


def _component(facts: Effect, example: Example) -> list[str]:
    """The component of a model file that holds the example; nothing for what belongs to one run."""
    if facts.single_event:
        return ["It belongs to one run, so no model file holds it."]
    candidate = fitted_example(facts, example).candidate
    values = {
        name: {"value": np.asarray(value).tolist(), "unit": candidate.unit(name)}
        for name, value in example.parameters.items()
    }
    content = {"effect": facts.id, "joint": candidate.joint, "joints": list(candidate.joints)}
    content |= ({"form": example.form} if example.form else {}) | {"parameters": values}
    text = yaml.safe_dump([content], sort_keys=False, default_flow_style=None, width=100)
    return ["and as a component of a `model.yaml`, which `armlab predict` computes:", f"```yaml\n{text}```"]
