"""What is concealed in which real recording by the fixed plan, which was written before any case was diagnosed.

The injected sizes follow from the error of each reference model on the validation runs: from about a third of it
to five times as much, at the joint where the disturbance shows most.
"""

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


WITHHELD: dict[str, tuple[tuple[Piece, ...], ...]] = {
    "emps": ((Piece("friction"),),),
    "staubli-tx40": (
        (Piece("wrist coupling"),),
        (Piece("friction"),),
        (Piece("wrist coupling"), Piece("friction")),
        (Piece("friction", 3),),
    ),
    "unisa-ur10": ((Piece("friction"),), (Piece("friction", 4),)),
    "kuka-kr300": (
        (Piece("counterbalance", 2),),
        (Piece("payload", 6),),
        (Piece("counterbalance", 2), Piece("payload", 6)),
        (Piece("friction", 5),),
    ),
}


def _payloads(link: int, centre: tuple[float, float, float], radius: float, *masses: float) -> tuple[Disturbance, ...]:
    return tuple(Disturbance("payload", link, mass, "kg", centre=centre, radius=radius) for mass in masses)


def _springs(*springs: tuple[int, float, float], unit: str = "N m/rad") -> tuple[Disturbance, ...]:
    """Joint, stiffness, rest."""
    return tuple(Disturbance("cable_stiffness", joint, size, unit, rest) for joint, size, rest in springs)


def _delays(*seconds: float) -> tuple[Disturbance, ...]:
    return tuple(Disturbance("time_delay", None, size, "s") for size in seconds)


def _wear(*joints: tuple[int, float], unit: str = "N m s/rad") -> tuple[Disturbance, ...]:
    """Joint, more viscous friction."""
    return tuple(Disturbance("viscous_friction", joint, size, unit) for joint, size in joints)


INJECTED: dict[str, tuple[Disturbance, ...]] = {
    "emps": (
        *_payloads(1, (0.0, 0.0, 0.0), 0.0, 2.0, 8.0),
        *_springs((1, 50.0, 0.1), (1, 200.0, 0.1), unit="N/m"),
        *_delays(0.001, 0.004),
        *_wear((1, 20.0), (1, 80.0), unit="N s/m"),
    ),
    "staubli-tx40": (
        *_payloads(6, (0.03, 0.02, 0.08), 0.04, 0.5, 2.0),
        *_springs((1, 2.0, 0.2), (3, 4.0, -0.3)),
        *_delays(0.002, 0.005),
        *_wear((2, 1.5), (5, 0.5)),
    ),
    "unisa-ur10": (
        *_payloads(6, (0.04, 0.03, 0.08), 0.05, 1.0, 4.0),
        *_springs((1, 2.0, 0.3), (3, 3.0, 0.5)),
        *_delays(0.016),
        *_wear((3, 4.0)),
    ),
    "kuka-kr300": (
        *_payloads(6, (0.1, 0.05, 0.2), 0.15, 20.0, 60.0),
        *_springs((1, 400.0, 0.2), (5, 300.0, -0.3)),
        *_delays(0.012, 0.04),
        *_wear((3, 2000.0), (6, 300.0)),
    ),
}


def cases_of(recording: str) -> tuple[Case, ...]:
    """The control first, then what is withheld, then what is injected."""
    withheld = (Case(recording, pieces) for pieces in WITHHELD[recording])
    return (Case(recording), *withheld, *(Case(recording, (), each) for each in INJECTED[recording]))
