"""The numbers of the files to import, on the side of the joints, for those who judge their units."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.imports.columns import Log
from armlab.recordings.imports.gears import Gear
from armlab.recordings.imports.sources import Source
from armlab.recordings.possible import OUTLIER_SHARE
from problem.arm import Joint

Units = Mapping[str, str | tuple[str, ...]]
POSITION_SIGNALS = ("position", "reference_position")
JUDGED_SIGNALS = (*POSITION_SIGNALS, "velocity", "torque")


@dataclass(frozen=True, eq=False)
class Numbers:
    """Rows of a file whose stamps, positions and torques are finite, in the units of the file, behind the gears.

    file: its path. joints: that the columns belong to. ratios: of the gears by signal, 1 where it was measured at the
    joints. time: (rows,), as it stands in the file. signals: (rows, joints) by name. step, short_step: of the time from
    row to row, the longer and the shorter of mean and median: neither gaps nor rows that come together decide.
    """

    file: str
    joints: tuple[Joint, ...]
    ratios: Mapping[str, tuple[float, ...]]
    time: Array
    signals: Mapping[str, Array]
    step: float
    short_step: float


def read_numbers(
    log: Log, sources: Mapping[str, Source], columns: Mapping[str, tuple[str, ...]], units: Units, gear: Gear | None
) -> tuple[Numbers, ...]:
    """The numbers of each file; none before robot, time and position are known, nor of stamps that do not rise."""
    owners = {joint.name: joint for joint in log.arm.joints} if log.arm else {}
    joints = tuple(owners[name] for name in log.joints if name in owners)
    if not joints or not {"time", "position"} <= set(units) or len(columns["position"]) != len(joints):
        return ()
    read = (_read_file(path, source, columns, joints, gear) for path, source in sources.items())
    return tuple(each for each in read if each is not None)


def _read_file(
    path: str,
    source: Source,
    columns: Mapping[str, tuple[str, ...]],
    joints: tuple[Joint, ...],
    gear: Gear | None,
) -> Numbers | None:
    wanted = [name for name in JUDGED_SIGNALS if len(columns.get(name, ())) == len(joints)]
    ones = (1.0,) * len(joints)
    ratios = {name: gear.ratios if gear and gear.is_before(name) else ones for name in wanted}
    factors = {name: gear.factors(name) if gear else ones for name in wanted}
    signals = {name: source.table.view(columns[name], name) for name in wanted}
    for name in wanted:
        if factors[name] != ones:
            signals[name] = signals[name] * np.array(factors[name])
    time = source.table.columns(columns["time"], "time")[:, 0]
    needed = [np.isfinite(values).all(axis=1) for name, values in signals.items() if name != "velocity"]
    whole = np.isfinite(time) & np.all(needed, axis=0)
    if not whole.all():
        time = time[whole]
        for name in wanted:  # one after the other, so that memory holds them once
            signals[name] = signals[name][whole]
    rises = np.diff(time)
    if not np.any(rises > 0):
        return None
    median = float(np.median(rises[rises > 0]))
    first, last = np.quantile(time, (OUTLIER_SHARE, 1 - OUTLIER_SHARE))
    mean = float(last - first) / ((1 - 2 * OUTLIER_SHARE) * len(rises)) or median
    return Numbers(path, joints, ratios, time, signals, max(median, mean), min(median, mean))


def torque_peaks(numbers: Numbers) -> Array:
    """The largest torque of each joint without outliers, (joints,), in the units of the file."""
    return np.array([np.quantile(np.abs(own), 1 - OUTLIER_SHARE) for own in numbers.signals["torque"].T])


def units_per_joint(unit: str | tuple[str, ...], joints: tuple[Joint, ...]) -> tuple[str, ...]:
    """The unit of each joint, of a signal that has one for all or one each."""
    return (unit,) * len(joints) if isinstance(unit, str) else unit
