"""Encoders that wrap around or repeat within a turn, and currents whose direction is a bit: read as signed numbers."""

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.recording import AnyRun, Finding

TURN_RAD = 2 * np.pi
ENCODER_SIGNALS = ("position", "link_position", "reference_position", "simulated_position")
ROUNDING = 1e-6  # of a turn
MIN_STEP_TURNS = 1e-3  # of a turn, at rest
PARTS_OF_TURN = (1, 2, 3, 4)  # encoders that repeat within a turn
FULL_SHARE = 0.9  # of its period that such an encoder has run through, and never more than all of it
MIN_SIGN_CHANGES = 4  # that tell a direction bit from a bad row


def unwrap_encoders(run: AnyRun, angles: dict[str, tuple[bool, ...]]) -> AnyRun:
    """Adds whole turns where a channel jumps by some between two samples.

    angles: for each signal, which of its channels are angles. A jump that is no whole turn is left alone.
    """
    for name in ENCODER_SIGNALS:
        if name in run.signals:
            for channel in np.flatnonzero(angles[name]):
                run = _unwrap_channel(run, name, int(channel))
    return run


def _unwrap_channel(run: AnyRun, name: str, channel: int) -> AnyRun:
    signal = run.signals[name]
    for parts in PARTS_OF_TURN:
        period = TURN_RAD / parts
        turns = _wraps(signal[:, channel], period)
        if turns is None or (parts > 1 and not FULL_SHARE <= np.ptp(signal[:, channel]) / period <= 1 + MIN_STEP_TURNS):
            continue
        mended = signal.copy()
        mended[1:, channel] -= period * np.cumsum(turns)
        what, kind = "whole turns", "wrapped_encoder"
        if parts > 1:
            what, kind = f"{360 / parts:g} degrees, its encoder repeats within a turn,", "encoder_period"
        text = f"{name} of channel {channel + 1} jumps by {what} {np.count_nonzero(turns)} time(s); unwrapped"
        return run.with_signals(run.time, {name: mended}).with_findings(Finding(kind, "repaired", text, channel + 1))
    return run


def _wraps(signal: Array, period: float) -> Array | None:
    """Periods by which a signal jumps between two samples, (samples - 1,); None where it does not or moves as fast.

    A signal that moves by whole periods alone counts turns and does not wrap.
    """
    steps = np.diff(signal)
    turns = np.rint(steps / period)
    moved = np.abs(steps - period * turns)
    # whole periods aside, most steps are motion
    ordinary = max(3 * float(np.quantile(moved, 0.98)), MIN_STEP_TURNS * period)
    wraps = (turns != 0) & (moved <= ordinary)
    counts = bool(moved.max(initial=0.0) < ROUNDING * period)
    return None if counts or not wraps.any() or ordinary > period / 2 else np.where(wraps, turns, 0.0)


DIRECTION_BITS = range(8, 16)


def read_direction_bit(run: AnyRun) -> AnyRun:
    """Torque or current that servos count as a size with a bit for its direction becomes a number with a sign.

    Such a channel holds whole counts from zero to twice the bit's value, and jumps by that value where it changes sign.
    """
    if "torque" not in run.signals:
        return run
    torque = run.signals["torque"]
    for channel, signal in enumerate(torque.T):
        bit = next((each for each in DIRECTION_BITS if _has_direction_bit(signal, 1 << each)), None)
        if bit is not None:
            signed = torque.copy()
            signed[:, channel] = np.where(signal >= 1 << bit, (1 << bit) - signal, signal)
            text = (
                f"the current of channel {channel + 1} holds its direction in bit {bit}: values above "
                f"{(1 << bit) - 1} are negative; read so (unsigned_current)"
            )
            run = run.with_signals(run.time, {"torque": signed})
            run, torque = run.with_findings(Finding("unsigned_current", "repaired", text, channel + 1)), signed
    return run


def _has_direction_bit(signal: Array, size: int) -> bool:
    if signal.min() < 0 or not size <= signal.max() < 2 * size or np.any(signal != np.rint(signal)):
        return False
    jumps = np.abs(np.diff(signal)) > size / 2
    signed = np.where(signal >= size, size - signal, signal)
    return bool(jumps.sum() >= MIN_SIGN_CHANGES and not np.any(np.abs(np.diff(signed)) > size / 2))
