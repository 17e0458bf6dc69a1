"""Effects of a position servo: they act on its command, not on the torque of a joint.

They have no columns and no candidates. Recordings of motion only show them; their law stands in
`armlab/diagnosis/motion/servo.py`.
"""

from armlab.effects.contract import ANGLE, TORQUE, Effect, Parameter

CONTROLLER_GAIN = Effect(
    "controller_gain_error",
    "gain of a position servo that differs from the simulation's",
    sentence="The controller gain of {place} differs from that in {model}",
    law=r"\tau_j = \text{kp} \, (r_j - q_j) - \text{kd} \; \dot{q}_j",
    parameters=(
        Parameter("kp", f"{TORQUE}/{ANGLE}", positive=True),
        Parameter("kd", f"{TORQUE}.s/{ANGLE}"),
    ),
    title="controller gain",
    origin="drive",
    experiment="record the same motion with a load of known mass, or with another gain",
)
COMMAND_DELAY = Effect(
    "command_delay",
    "command that takes effect late",
    sentence="A command to {place} takes effect later than in {model}",
    figures="{seconds}",
    law=r"\tau_j(t) = \text{kp} \, (r_j(t - \text{seconds}) - q_j(t)) - \text{kd} \; \dot{q}_j(t)",
    parameters=(Parameter("seconds", "s", sampled=True),),
    origin="timing",
    experiment="log the time at which each joint is read; record steps and fast motion",
)
DEAD_BAND = Effect(
    "controller_dead_band",
    "position servo that ignores small errors",
    sentence="The servo of {place} ignores small errors, and in {model} it does not",
    figures="{width}",
    law=r"\tau_j = \text{kp} \, d(r_j - q_j), \quad d(e) = \operatorname{sgn}(e) \max(|e| - \text{width} / 2, 0)",
    parameters=(Parameter("width", ANGLE, positive=True),),
    title="dead band",
    origin="drive",
    experiment="record slow ramps in both directions with two gains",
)
COMMAND_OFFSET = Effect(
    "command_offset",
    "command that is off by a constant",
    sentence="The command to {place} is off by a constant that {model} does not have",
    figures="{offset}",
    law=r"\tau_j = \text{kp} \, (r_j + \text{offset} - q_j) - \text{kd} \; \dot{q}_j",
    parameters=(Parameter("offset", ANGLE),),
    origin="drive",
    experiment="hold a variety of poses, each reached from both directions",
)
SERVO_EFFECTS = (CONTROLLER_GAIN, COMMAND_DELAY, DEAD_BAND, COMMAND_OFFSET)
