"""Encoders that wrap around: a revolute channel that jumps by a whole turn within one sample."""

import numpy as np

from recordings.run import Finding, Run

TURN = 2 * np.pi
ENCODERS = ("position", "link_position", "reference_position", "simulated_position")
AT_REST = 1e-3  # of a turn, at rest


def unwrapped(run: Run, angles: dict[str, tuple[bool, ...]]) -> Run:
    """Adds whole turns where a channel jumps by some between two samples.

    angles: for each signal, which of its channels are angles. A jump that is no whole turn is left alone.
    """
    for name in ENCODERS:
        if name in run.signals:
            for channel in np.flatnonzero(angles[name]):
                run = _unwrap_channel(run, name, int(channel))
    return run


def _unwrap_channel(run: Run, name: str, channel: int) -> Run:
    signal = run.signals[name]
    steps = np.diff(signal[:, channel])
    turns = np.rint(steps / TURN)
    moved = np.abs(steps - TURN * turns)
    ordinary = max(3 * float(np.quantile(moved, 0.98)), AT_REST * TURN)  # whole turns aside, most steps are motion
    wraps = (turns != 0) & (moved <= ordinary)
    if not wraps.any() or ordinary > TURN / 2:
        return run
    mended = signal.copy()
    mended[1:, channel] -= TURN * np.cumsum(np.where(wraps, turns, 0))
    text = f"{name} of channel {channel + 1} jumps by whole turns {wraps.sum()} time(s); unwrapped"
    finding = Finding("wrapped_encoder", "repaired", text, channel + 1)
    return run.with_signals(run.time, {name: mended}).noted(finding)
