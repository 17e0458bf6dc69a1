"""The gears of a log whose signals were measured at the motors: as given with `--gear-ratio` and `--motor-side`."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from armlab.common.errors import InputError
from armlab.recordings.channels import DRIVE_SIGNALS, MOTOR_SIDE_SIGNALS
from armlab.recordings.imports.questions import Options

MAX_RATIO = 1e5  # turns of the motor in one of the joint, either way; a sliding joint: rad of the motor in one m


@dataclass(frozen=True)
class Gear:
    """What leads from the motors to the joints: position / ratio, torque x ratio, one ratio a joint with its sign.

    position, torque: whether these were measured at the motors; commands and velocities are where positions are.
    """

    ratios: tuple[float, ...]
    position: bool = True
    torque: bool = True

    def is_before(self, signal: str) -> bool:
        """Whether a signal was measured at the motors."""
        return (signal in MOTOR_SIDE_SIGNALS and self.position) or (signal in DRIVE_SIGNALS and self.torque)

    def factors(self, signal: str) -> tuple[float, ...]:
        """What the numbers of a signal are multiplied with, one a joint."""
        if not self.is_before(signal):
            return (1.0,) * len(self.ratios)
        return self.ratios if signal in DRIVE_SIGNALS else tuple(1 / ratio for ratio in self.ratios)

    def transmission(self, has_torque: bool) -> dict[str, Any]:
        """The key `transmission` of `recording.yaml`: matrices from the motors to the joints."""
        wanted = {"position": self.position, "torque": self.torque and has_torque}
        return {signal: np.diag(self.factors(signal)).tolist() for signal, is_wanted in wanted.items() if is_wanted}


def choose_gear(options: Options, columns: Mapping[str, tuple[str, ...]], has_all_columns: bool) -> Gear | None:
    """The gears as given, None without them. columns: those that are known, by the signal; has_all_columns: no other.

    Raises InputError for what is no ratio, for another number of ratios than of columns of the position, and for a log
    without the signal that `--motor-side` names.
    """
    given, side = options.get("gear_ratio"), options.get("motor_side")
    if given is None:
        if side is not None:
            raise InputError(f"--motor-side {side} needs the gears: give --gear-ratio NUMBER,NUMBER,...")
        return None
    ratios = _parse_ratios(given)
    if "position" in columns and len(ratios) != len(columns["position"]):
        raise InputError(f"--gear-ratio holds {len(ratios)} numbers for {len(columns['position'])} columns of position")
    if side == "torque" and has_all_columns and side not in columns:
        raise InputError(
            "--motor-side torque needs columns of torque, which this recording of motion only does not have"
        )
    return Gear(ratios, position=side != "torque", torque=side != "position")


def _parse_ratios(text: str) -> tuple[float, ...]:
    try:
        ratios = tuple(float(part) for part in text.split(","))
    except ValueError:
        ratios = ()
    if not ratios or not all(1 / MAX_RATIO <= abs(ratio) <= MAX_RATIO for ratio in ratios):
        raise InputError(
            f"--gear-ratio {text} should be turns of the motor in one turn of the joint, one number a joint with "
            f"commas between them, not zero, {MAX_RATIO:g} at most; negative where they turn against each other"
        )
    return ratios
