"""The detection limit of recordings of motion, and the size of what is hidden in limits.

The oracle knows the law, the state at the start and the noise. It replays the commands with and without the effect,
with encoders that have no steps. Its noise is what the record differs from the replay of the truth: steps of the
encoder in the record and within the loop of the drive, and late stamps. s is the standard deviation of that noise at a
joint, and k = 1 + 2 sum of its autocorrelations. D is the difference of the replays on the identification runs, over
s sqrt(k), without its part along what changes of kp, damping and friction of the joints concerned do to these joints.

    multiple = |D| / (z(1 - level / (2 tests)) + z(power))

Where drives hold the commands of several samples, nobody knows when within a sample their clocks tick: of a delay only
what is beyond one sample counts. A drive that reads its position in counts does not act on an error within a count
either: of a dead band only what is beyond one count does.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.stats import norm

from armlab.common.arrays import Array
from armlab.proof.blind.servo.servo_commands import REST_S
from armlab.proof.blind.servo.servo_engine import STEP_S, ServoArm, simulate
from armlab.proof.blind.servo.servo_hidden import FREE_IN_EVERY_FIT, KINDS, Hidden
from armlab.proof.blind.servo.servo_plan import MotionRun, ServoCase


@dataclass(frozen=True)
class ServoOracleSettings:
    """level: over all effects and joints. step: relative, of the numbers that are free. correlated: an autocorrelation
    below it ends the sum. evaluations: of a size. near: relative error of a size that is good enough.
    """

    level: float = 0.01
    power: float = 0.9
    step: float = 0.02
    correlated: float = 0.05
    evaluations: int = 7
    near: float = 0.1


ORACLE = ServoOracleSettings()


def replay(case: ServoCase, arm: ServoArm, run: MotionRun, smooth: bool) -> Array:
    """Positions (samples, joints), rad, at the instants at which they are read; smooth: encoders without steps."""
    if smooth:
        arm = replace(arm, servos=tuple(replace(servo, count=0.0) for servo in arm.servos))
    fine = simulate(arm, run.command, 1 / case.rate_hz, case.drawn[1])
    time = np.arange(len(fine)) * STEP_S
    late = case.read_gap_s * np.arange(arm.joints)
    instants = np.arange(round(REST_S * case.rate_hz), len(run.command)) / case.rate_hz
    read = [np.interp(instants + late[joint], time, fine[:, joint]) for joint in range(arm.joints)]
    return np.stack(read, axis=1)


def record(case: ServoCase, arm: ServoArm, number: int) -> tuple[Array, Array]:
    """Stamps (samples,), s, and positions (samples, joints), rad, of a run as the log has them."""
    counts = np.array([servo.count for servo in arm.servos])
    read = np.rint(replay(case, arm, case.runs[number], smooth=False) / counts) * counts
    late = np.abs(case.stream(f"stamps {number}").normal(0, case.jitter_s, len(read)))
    return np.arange(len(read)) / case.rate_hz + late, read


@dataclass(frozen=True)
class ServoOracle:
    """The oracle of a case. arm: whose noise and free numbers count."""

    case: ServoCase
    arm: ServoArm

    @property
    def runs(self) -> list[int]:
        """Numbers of the runs that identify."""
        return [number for number, run in enumerate(self.case.runs) if run.role == "identify"]

    def smooth(self, arm: ServoArm) -> list[Array]:
        """Replays of the identification runs."""
        return [replay(self.case, arm, self.case.runs[number], smooth=True) for number in self.runs]

    @cached_property
    def own(self) -> list[Array]:
        """Replays of the arm."""
        return self.smooth(self.arm)

    @cached_property
    def noise(self) -> Array:
        """s sqrt(k) of each joint, (joints,), rad."""
        errors = []
        for number, clean in zip(self.runs, self.own, strict=True):
            stamps, read = record(self.case, self.arm, number)
            late = stamps - np.arange(len(read)) / self.case.rate_hz
            speed = np.gradient(clean, 1 / self.case.rate_hz, axis=0)
            errors.append(read - clean - speed * late[:, None])
        return np.array(
            [_long_run_deviation([error[:, joint] for error in errors]) for joint in range(self.arm.joints)]
        )

    def multiple(self, hidden: Hidden, with_it: ServoArm, without: ServoArm) -> float:
        """Detection limits of a difference between two arms."""
        with_it = with_it if hidden.kind not in ("delay", "dead band") else self._beyond_steps(hidden).apply(without)
        before = self.own if without is self.arm else self.smooth(without)
        after = self.own if with_it is self.arm else self.smooth(with_it)
        added = self._weighted(after, before)
        columns = [_only(joint, self._changes[field]) for joint, field in self._free(hidden)]
        matrix = np.stack([column.ravel() for column in columns], axis=1)
        rest = added.ravel() - matrix @ np.linalg.lstsq(matrix, added.ravel(), rcond=None)[0]
        tests = len(KINDS) * self.arm.joints
        needed = norm.ppf(1 - ORACLE.level / (2 * tests)) + norm.ppf(ORACLE.power)
        return float(np.linalg.norm(rest) / needed)

    def _beyond_steps(self, hidden: Hidden) -> Hidden:
        """A delay or dead band without the part that steps of time or of the encoder make as well."""
        step = 1 / self.case.rate_hz if self.case.hold > 1 else 0.0
        if hidden.kind == "dead band":
            step = self.arm.servos[hidden.joint].count
        return replace(hidden, size=max(hidden.size - step, 0.0))

    def _weighted(self, first: Sequence[Array], second: Sequence[Array]) -> Array:
        """Difference of replays over the noise, (samples of all runs, joints)."""
        return np.concatenate([(a - b) / self.noise for a, b in zip(first, second, strict=True)])

    def _free(self, hidden: Hidden) -> list[tuple[int, str]]:
        """Joints and fields of their servos that every fit has free."""
        everywhere = hidden.kind in ("delay", "payload")
        own = "damping" if hidden.kind == "damping of the drive" else FREE_IN_EVERY_FIT.get(hidden.kind)
        joints = range(self.arm.joints) if everywhere else [hidden.joint]
        return [(joint, field) for joint in joints for field in FREE_IN_EVERY_FIT.values() if field != own]

    @cached_property
    def _changes(self) -> dict[str, Array]:
        """What a change of a field at all joints at once makes of each joint's position, weighted."""
        out = {}
        for kind, field in FREE_IN_EVERY_FIT.items():
            arm = self.arm
            for joint in range(arm.joints):
                arm = Hidden(kind, joint, size=ORACLE.step).apply(arm)
            out[field] = self._weighted(self.smooth(arm), self.own)
        return out


def _only(joint: int, change: Array) -> Array:
    out = np.zeros_like(change)
    out[:, joint] = change[:, joint]
    return out


def find_size(oracle: ServoOracle, hidden: Hidden, wanted: float) -> tuple[Hidden, float]:
    """The difference with a size of about `wanted` detection limits, and its multiple; at most the largest size."""
    tried: list[tuple[float, float]] = []  # sizes and multiples
    size = hidden.facts.largest
    for _ in range(ORACLE.evaluations):
        sized = replace(hidden, size=size)
        multiple = oracle.multiple(sized, sized.apply(oracle.arm), oracle.arm)
        tried.append((size, multiple))
        if abs(multiple / wanted - 1) <= ORACLE.near or (size == hidden.facts.largest and multiple < wanted):
            break
        size = _next_size(tried, wanted)
    best = min(tried, key=lambda each: abs(np.log(max(each[1], 1e-9) / wanted)))
    return replace(hidden, size=best[0]), best[1]


def _next_size(tried: Sequence[tuple[float, float]], wanted: float) -> float:
    """Between the nearest sizes below and above: proportional, but at least a tenth of the gap away from both ends."""
    low = max((each for each in tried if each[1] < wanted), default=(0.0, 0.0))
    high = min(each for each in tried if each[1] >= wanted)
    share = (wanted - low[1]) / (high[1] - low[1])
    if low[0] == 0.0:
        return high[0] * max(share, 1e-4)
    return float(low[0] + (high[0] - low[0]) * np.clip(share, 0.1, 0.9))


def _long_run_deviation(errors: Sequence[Array]) -> float:
    """Square root of the variance times 1 + 2 sum of the autocorrelations, up to the first small one."""
    variance = float(np.mean(np.concatenate(errors) ** 2))
    total, longest = 1.0, min(len(each) for each in errors) // 2
    for lag in range(1, longest):
        own = float(np.mean(np.concatenate([each[lag:] * each[:-lag] for each in errors]))) / variance
        if own < ORACLE.correlated:
            break
        total += 2 * own
    return float(np.sqrt(variance * total))
