"""A reading: how the channels of a recording and the robot file become motion, torque and links.

    q(t) = P raw_q[order] + offset,    tau(t) = T raw_tau[order] at the time t + delay,    t = stamp / clock

A mistake in the recording or the robot file is a change of one of these quantities. `Reading.corrected` takes mistakes
back one after the other.
"""

from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.recordings.recording import Recording
from problem.arm import Arm

BOTH = "position and torque"  # the form of a mistake
OF_LINKS = "of the links"  # the form of a mistake
LINK_DATA = "link_data_error"
SPRING = "cable_stiffness"  # physics that a joint may have in the place of a mistake


@dataclass(frozen=True)
class Mistake:
    """One way in which a recording or a robot file is read wrongly; or a spring of a joint, which may look like one.

    effect: an id of the setup effects, or `SPRING`. joint: from 1, the link of `link_data_error`, None for the whole
    robot. joints: the exchanged pair, or an order of all channels. form: which quantity. parameters: (name, value,
    unit).
    """

    effect: str
    joint: int | None = None
    joints: tuple[int, ...] = ()
    form: str = ""
    parameters: tuple[tuple[str, float | tuple[float, ...], str], ...] = ()

    def value(self, name: str) -> float:
        """The number of a parameter."""
        return float(np.sum(next(value for own, value, _ in self.parameters if own == name)))

    @property
    def label(self) -> str:
        """Effect and place, as in `joint_direction@2`."""
        place = ",".join(map(str, self.joints)) if len(self.joints) > 1 else "" if self.joint is None else self.joint
        return f"{self.effect}@{place}" if place else self.effect


@dataclass(frozen=True, eq=False)
class Reading:
    """How recorded channels become joint signals, SI units.

    position: (joints, channels); offset: (joints,); torque: (joints, channels), gains included. drives: (drives,
    joints), how far joints move the drives whose friction they feel, as the recording states it. position_order,
    torque_order: which recorded channel stands at each place. clock: recorded time over true time. delay: (joints,), s,
    by which torque is late. arm, inertial: the robot, and (10 * joints,) of the links of the simulation if there is
    one. mistakes: what was taken back. springs: joints (from 0) that have one beside links and friction.
    adds_gravity: of the links of the robot file, which the drive took from the torque. friction_ways: of each
    joint, the share of its travel over which friction turns after a reversal; 0 or none: it turns at once.
    """

    position: Array
    offset: Array
    torque: Array
    drives: Array
    position_order: tuple[int, ...]
    torque_order: tuple[int, ...]
    clock: float
    delay: Array
    arm: Arm
    inertial: Array | None
    mistakes: tuple[Mistake, ...] = ()
    springs: tuple[int, ...] = ()
    adds_gravity: bool = False
    friction_ways: tuple[float, ...] = ()

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.arm)

    def with_mistake(self, mistake: Mistake) -> "Reading":
        """The same reading with one more mistake in its list."""
        return replace(self, mistakes=(*self.mistakes, mistake))

    def scale_position(self, joints: slice | int, factor: float) -> "Reading":
        """Positions of some joints times a factor, zeros kept."""
        changed = self.position.copy()
        changed[joints] *= factor
        return replace(self, position=changed)

    def scale_torque(self, joints: slice | int, factor: float) -> "Reading":
        """Torques of some joints times a factor."""
        changed = self.torque.copy()
        changed[joints] *= factor
        return replace(self, torque=changed)

    def shift_zero(self, joint: int, angle: float) -> "Reading":
        """Positions of a joint (from 0) plus an angle."""
        return replace(self, offset=self.offset + angle * np.eye(self.joints)[joint])

    def reorder(self, order: tuple[int, ...], form: str) -> "Reading":
        """Other channels for the places. form: position, torque, or `BOTH`."""
        out = self
        if form in ("position", BOTH):
            out = replace(out, position_order=tuple(self.position_order[each] for each in order))
        if form in ("torque", BOTH):
            out = replace(out, torque_order=tuple(self.torque_order[each] for each in order))
        return out

    def with_gravity(self, gravity: Array) -> "Reading":
        """Another gravity (3,) in the base frame."""
        x, y, z = (float(value) for value in gravity)
        return replace(self, arm=replace(self.arm, gravity=(x, y, z)))

    def with_spring(self, joint: int) -> "Reading":
        """The torque of a joint (from 0) may hold a spring."""
        return replace(self, springs=(*self.springs, joint))

    def late_by(self, seconds: float, joint: int | None = None) -> "Reading":
        """Torque (of one joint, from 0) that is read so much later."""
        more = np.full(self.joints, seconds) if joint is None else seconds * np.eye(self.joints)[joint]
        return replace(self, delay=self.delay + more)


def second_drives(reading: Reading) -> tuple[int | None, ...]:
    """Of each joint the drive besides its own that acts on it most; None where none does."""
    others = np.abs(reading.drives.T) * (1 - np.eye(reading.joints))
    return tuple(int(np.argmax(row)) if row.any() else None for row in others)


def _drives_of(torque: Array) -> Array:
    """How far joints move drives, with the largest entry of each row one.

    By virtual work: tau = T tau_drives, so that drives move with T' qd.
    """
    moved = torque.T
    largest = np.take_along_axis(moved, np.argmax(np.abs(moved), axis=1)[:, None], axis=1)
    return np.asarray(moved / np.where(largest == 0, 1.0, largest))


def read_as_is(recording: Recording, inertial: Array | None) -> Reading:
    """The reading that the recording and its robot file state. inertial: (10 * joints,) of the simulation's links."""
    given, joints = recording.transmission, len(recording.arm)
    return Reading(
        position=given.position,
        offset=given.offset,
        torque=given.torque * given.gains,
        drives=_drives_of(given.torque),
        position_order=tuple(range(given.position.shape[1])),
        torque_order=tuple(range(given.torque.shape[1])),
        clock=1.0,
        delay=np.zeros(joints),
        arm=recording.arm,
        inertial=inertial,
    )
