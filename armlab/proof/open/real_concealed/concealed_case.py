"""What may be concealed in a real recording: parts of its model that are withheld, or a disturbance that is added."""

from dataclasses import dataclass
from typing import Literal

PieceKind = Literal["friction", "wrist coupling", "counterbalance", "payload"]
DisturbanceKind = Literal[
    "payload",
    "cable_stiffness",
    "time_delay",
    "channel_skew",
    "viscous_friction",
    "coulomb_friction",
    "torque_gain_error",
    "torque_ripple",
    "rotor_inertia",
    "torque_offset",
]


@dataclass(frozen=True)
class Piece:
    """A part of the reference model. joint: from 1; None where every joint with such a part loses it."""

    kind: PieceKind
    joint: int | None = None

    def __str__(self) -> str:
        """For a table."""
        if self.joint is None:
            return self.kind
        return f"{self.kind} of {'link' if self.kind == 'payload' else 'joint'} {self.joint}"


@dataclass(frozen=True)
class Disturbance:
    """What is added to a recorded torque. size: in `unit`; a delay's in seconds, a gain's the share that is read more.

    joint: from 1, the link of a payload, None for all channels. rest: of a spring, rad (m). centre: of a payload, m
    in the link's frame. radius: of that body, a ball, m. width: speed at which Coulomb friction turns over, rad/s
    (m/s). order: of a ripple, cycles a turn (rad/m). phase: of a ripple, rad.
    """

    effect: DisturbanceKind
    joint: int | None
    size: float
    unit: str
    rest: float = 0.0
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    radius: float = 0.05
    width: float = 0.0
    order: int = 0
    phase: float = 0.0

    def __str__(self) -> str:
        """For a table."""
        size, place = f"{self.size:g} {self.unit}", f"at joint {self.joint}"
        match self.effect:
            case "time_delay":
                return f"torque late by {1e3 * self.size:g} ms"
            case "channel_skew":
                return f"torque of joint {self.joint} late by {1e3 * self.size:g} ms"
            case "payload":
                return f"payload of {size} at link {self.joint}"
            case "torque_gain_error":
                return f"torque of joint {self.joint} times {1 + self.size:g}"
            case "torque_ripple":
                return f"ripple of {size}, order {self.order}, {place}"
            case "cable_stiffness":
                return f"spring of {size} {place}"
            case "coulomb_friction":
                return f"Coulomb friction of {size} {place}"
            case "torque_offset":
                return f"constant torque of {size} {place}"
            case _:
                return f"{self.effect.replace('_', ' ')} of {size} {place}"


@dataclass(frozen=True)
class Case:
    """A public recording with parts withheld from its reference model, or with a disturbance; or with neither."""

    recording: str
    withheld: tuple[Piece, ...] = ()
    injected: Disturbance | None = None

    @property
    def name(self) -> str:
        """What is concealed."""
        if self.injected is not None:
            return str(self.injected)
        return f"without {' and '.join(map(str, self.withheld))}" if self.withheld else "nothing"

    @property
    def control(self) -> bool:
        """Whether nothing is concealed."""
        return not self.withheld and self.injected is None
