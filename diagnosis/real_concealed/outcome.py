"""What a diagnosis said of a case, as plain data that can be kept and judged later."""

from dataclasses import dataclass

from armlab.diagnosis.result import Claim

Span = tuple[float, float]


@dataclass(frozen=True)
class Size:
    """A parameter with one number, and its 95 % interval."""

    name: str
    value: float
    interval: Span | None
    unit: str


@dataclass(frozen=True)
class Rival:
    """A name that fits these data as well."""

    effect: str
    joints: tuple[int, ...]


@dataclass(frozen=True)
class Said:
    """A finding. joints: as in `Sought`."""

    effect: str
    joints: tuple[int, ...]
    equation: str
    sizes: tuple[Size, ...]
    rivals: tuple[Rival, ...]


@dataclass(frozen=True)
class Outcome:
    """Of one case, on the runs that took no part, each joint's RMS in N m (N) of the filtered torque.

    given: error of the simulation that was handed over. named: with every named finding; found: with surrogates of what
    is unknown as well. hidden: of the torque of what is concealed. torque: as measured. recovered: share of the hidden
    torque that findings with a name sought for it hold, None in a control.
    """

    case: str
    said: tuple[Said, ...]
    given: tuple[float, ...]
    named: tuple[float, ...]
    found: tuple[float, ...]
    hidden: tuple[float, ...]
    torque: tuple[float, ...]
    recovered: float | None
    seconds: float


def said_of(claim: Claim) -> Said:
    """A claim without its arrays."""
    sizes = []
    for each in claim.parameters:
        if isinstance(each.value, tuple):
            continue
        span = each.interval
        pair = (float(span[0]), float(span[1])) if span and not isinstance(span[0], tuple) else None
        sizes.append(Size(each.name, float(each.value), pair, each.unit))
    rivals = tuple(Rival(each.effect, _places(each.joint, each.joints)) for each in claim.rivals)
    return Said(claim.effect, _places(claim.joint, claim.joints), claim.equation, tuple(sizes), rivals)


def _places(joint: int | None, joints: tuple[int, ...]) -> tuple[int, ...]:
    if joint is None:
        return ()
    return joints if len(joints) > 1 else (joint,)
