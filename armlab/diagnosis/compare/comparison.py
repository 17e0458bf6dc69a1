"""The comparison of two recordings of one robot: each diagnosed alone, both in one structure, and the new recording
against the model of the old one.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.errors import InputError
from armlab.diagnosis.compare.structure import Change, changes_between
from armlab.diagnosis.diagnose import diagnose
from armlab.diagnosis.formats import ComparisonStatus
from armlab.diagnosis.found_model import model_found
from armlab.diagnosis.result import Diagnosis
from armlab.diagnosis.settings import Baseline, Guards, Settings
from armlab.effects.scene import scene_of
from armlab.recordings.differentiate import differentiate
from armlab.recordings.recording import Recording, Run
from problem.arm import Arm
from problem.pseudo_inertia import links_of

GEOMETRY_TOLERANCE = 1e-6  # rad (m): geometry that counts as that of the same robot


@dataclass(frozen=True, eq=False)
class Comparison:
    """old, new: each on its own. against: the new recording with the old one's model as its simulation.

    reason: of an inconclusive comparison.
    """

    status: ComparisonStatus
    old: Diagnosis
    new: Diagnosis
    against: Diagnosis | None = None
    changes: tuple[Change, ...] = ()
    reason: str = ""

    def __repr__(self) -> str:
        """The status, how many parameters changed, and what the new recording shows against the old model."""
        changed = sum(each.changed for each in self.changes)
        lines = [f"Comparison of {self.old.recording.name!r} with {self.new.recording.name!r}: {self.status}"]
        if self.against is None:
            return "\n".join([*lines, f"  {self.reason}"])
        lines.append(f"  {changed} of {len(self.changes)} parameters changed (1 %, Holm)")
        effects = [f"{each.effect}@{each.joint}" if each.joint else each.effect for each in self.against.claims]
        return "\n".join([*lines, f"  new recording against old model: {', '.join(effects) or 'nothing'}"])


def compare(
    old: Recording,
    new: Recording,
    baseline: Baseline | None = None,
    seed: int = 0,
    progress: Callable[[str], None] = lambda message: None,
) -> Comparison:
    """What changed from the old recording to the new one; InputError where they are not of one robot."""
    _check_same_robot(old, new)
    new = replace(new, arm=old.arm, simulation=old.simulation)

    def progress_of(which: str) -> Callable[[str], None]:
        return lambda message: progress(f"{which}: {message}")

    first = diagnose(old, baseline, seed, progress=progress_of("old recording"))
    second = diagnose(new, baseline, seed, progress=progress_of("new recording"))
    for each in (first, second):
        if each.status == "inconclusive" or each.inertial is None:
            return Comparison("inconclusive", first, second, reason=f"{each.recording.name}: {each.summary}")
    signs_may_fall = Settings(guards=replace(Guards(), physics_signs=False))  # a change may be less friction
    simulated = with_simulation(new, first)
    against = diagnose(simulated, "simulated", seed, signs_may_fall, progress_of("new recording, old model"))
    if against.status == "inconclusive":
        return Comparison("inconclusive", first, second, reason=against.summary)
    status: ComparisonStatus = "changed" if against.status == "mismatch" else "same"
    return Comparison(status, first, second, against, changes_between(first, second))


def _check_same_robot(old: Recording, new: Recording) -> None:
    pairs = zip(old.arm.joints, new.arm.joints, strict=False)
    alike = len(old.arm) == len(new.arm) and all(
        one.kind == other.kind
        and np.allclose(one.before, other.before, atol=GEOMETRY_TOLERANCE)
        and np.allclose(one.after, other.after, atol=GEOMETRY_TOLERANCE)
        for one, other in pairs
    )
    if not alike:
        raise InputError(f"{old.name} is of {old.arm.name}, {new.name} of {new.arm.name}: not the same geometry")


def with_simulation(new: Recording, old: Diagnosis) -> Recording:
    """The new recording with the torque that the old one's model predicts for its runs, and the old one's links."""
    runs = tuple(_run_with_prediction(run, old) for run in new.runs)
    return replace(new, arm=_arm_with_found_links(old), simulation=None, runs=runs)


def _arm_with_found_links(old: Diagnosis) -> Arm:
    """The arm with the links that were found; as it is where there are none to start from."""
    arm = old.simulation.arm
    if old.simulation.inertial is None or old.inertial is None:
        return arm
    return replace(arm, links=links_of(old.inertial), rotor_inertia=())


def _run_with_prediction(run: Run, old: Diagnosis) -> Run:
    signals = differentiate(run)
    time = signals.run.time
    torque = model_found(old).torque_in(scene_of(signals.run, signals.motion, old.simulation.arm))
    columns = [np.interp(run.time, time, torque[:, joint]) for joint in range(torque.shape[1])]
    return replace(run, simulated_torque=np.column_stack(columns))
