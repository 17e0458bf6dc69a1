"""The diagnosis of a recording of motion only, step by step.

`diagnose_motion` is the whole flow: check that positions answer their commands, cut the runs into windows, choose and
fit the servo of each joint (`arm_fit.py`), take back what held-out runs do not bear out (`second_thoughts.py`), name
what differs from the simulation (`differences.py`), and send the commands of the held-out runs through the simulation
before and after (`held_out.py`).
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.diagnosis.motion.arm_fit import ArmFit, fit_arm
from armlab.diagnosis.motion.choose import ChosenServo, first_fit
from armlab.diagnosis.motion.couple import coupled_windows
from armlab.diagnosis.motion.differences import (
    name_delay,
    name_differences,
    name_payload,
    rivals_of_numbers,
    with_given_delay,
    with_given_nominal,
)
from armlab.diagnosis.motion.held_out import (
    JointTrials,
    errors_of_joint,
    replay_named,
    replays_as_well,
    rise_of,
    stretch_squares,
)
from armlab.diagnosis.motion.hold import hold_commands, holds_samples
from armlab.diagnosis.motion.motion_result import MotionDiagnosis, ReplayError, ServoFinding, Status
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.replay import replay, tool_rms
from armlab.diagnosis.motion.second_thoughts import place_damping, with_stated_scale, without_worse
from armlab.diagnosis.motion.servo import PARAMETERS
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, read_servo_simulation
from armlab.diagnosis.motion.shared_number import (
    COMMON_DELAY,
    TOOL_MASS,
    FoundNumber,
    cost_of,
    weigh,
    with_more,
)
from armlab.diagnosis.motion.windows import Windows, make_windows, window_stretches
from armlab.diagnosis.motion.witness import correlate_currents
from armlab.recordings.motion import MotionRecording
from armlab.recordings.motion_check import MIN_MOVED, check_answers
from armlab.recordings.recording import MotionRun

NO_SERVO = "no joint follows its command as a position servo does: check the columns, or the controller is another"


def diagnose_motion(
    recording: MotionRecording,
    progress: Callable[[str], None] = lambda message: None,
    tuning: MotionTuning = DEFAULT,
) -> MotionDiagnosis:
    """Which numbers of its servos the simulation of a recording gets wrong, and how much better it replays with others.

    progress: is told what is being done. Raises InputError where the simulation cannot be used.
    """
    started = time.perf_counter()
    simulation = given = read_servo_simulation(recording)
    reason = reason_unusable(recording)
    if reason is not None:
        return MotionDiagnosis(recording, simulation, "inconclusive", reason)
    learned, held_out = split_runs(recording, tuning.held_out_share)
    progress("fitting each joint alone")
    firsts = _first_fits(learned, simulation, tuning)
    held = holds_samples(recording.runs, given.rate_hz)
    if held:
        progress("finding the clock of the drives")
        simulation = replace(given, rate_hz=None)
    bare_simulation = replace(given, rate_hz=simulation.rate_hz)

    def conclude(fit: ArmFit, shared: Sequence[FoundNumber]) -> MotionDiagnosis:
        taken = hold_commands(held_out, given, fit.values, tuning) if held else held_out
        judged = coupled_windows(taken, fit.simulation, fit.values, fit.tuning)
        whole = replace(fit.tuning, wanted_windows=1, longest_window_s=np.inf)
        runs = coupled_windows(taken, fit.simulation, fit.values, whole)
        stated = replace(fit, chosen=with_stated_scale(fit, tuning))
        kept = replace(stated, chosen=without_worse(stated, runs, tuning))
        placed = replace(fit, chosen=place_damping(kept, judged, tuning))
        return HeldOut(recording, bare_simulation, placed, shared, judged, runs, taken, tuning).conclude()

    def taken(servos: Sequence[Array | None]) -> Sequence[MotionRun]:
        return hold_commands(learned, given, servos, tuning) if held else learned

    fit = fit_arm(taken, simulation, firsts, progress, tuning)
    if not any(fit.chosen):
        return MotionDiagnosis(recording, simulation, "inconclusive", NO_SERVO)
    progress("replaying held-out runs")
    concluded = conclude(fit, ())
    for each, shared in _with_shared_numbers(taken, fit, progress):
        tried = conclude(each, shared)
        named = {finding.parameter.key for finding in tried.findings}
        if all(own.number.key in named for own in shared) and replays_as_well(tried, concluded, tuning):
            concluded = tried
            break
    if concluded.servos is None:
        return concluded
    return replace(
        concluded,
        simulation=replace(concluded.simulation, rate_hz=given.rate_hz),
        odd=tuple(_odd_stretches(learned, concluded.chosen, tuning)),
        seconds=time.perf_counter() - started,
    )


def _with_shared_numbers(
    taken: Callable[[Sequence[Array | None]], Sequence[MotionRun]],
    bare: ArmFit,
    progress: Callable[[str], None],
) -> list[tuple[ArmFit, tuple[FoundNumber, ...]]]:
    """The arm with numbers that all joints share and that servos alone do not explain as well, the best first.

    A delay of all commands, a mass at the tool, or both. taken: as `fit_arm` has it. bare: without them.
    """
    found = list[tuple[ArmFit, tuple[FoundNumber, ...]]]()
    progress(COMMON_DELAY.doing)
    late = weigh(COMMON_DELAY, taken, bare, progress)
    progress(TOOL_MASS.doing)
    loaded = weigh(TOOL_MASS, taken, bare, progress)
    if late is not None and loaded is not None:
        both = weigh(TOOL_MASS, taken, late[0], progress)
        found += [] if both is None else [(both[0], (late[1], both[1]))]
    found += [(fit, (number,)) for fit, number in filter(None, (late, loaded))]
    return sorted(found, key=lambda each: cost_of(each[0], bare))


def reason_unusable(recording: MotionRecording) -> str | None:
    """Why nothing can be said, in one line; None where something can."""
    findings = check_answers(recording.runs, recording.arm)
    wrong = [finding.text for finding in findings if finding.kind != "still_joint"]
    if wrong:
        return wrong[0]
    if len(findings) == len(recording.joints):
        return "no joint moves: record motion of each joint, fast and slow, in both directions"
    return None


def split_runs(
    recording: MotionRecording, held_out_share: float = DEFAULT.held_out_share
) -> tuple[list[MotionRun], list[MotionRun]]:
    """The runs that identify, and those that are held out: runs that validate, else the last third of each run."""
    learned, held_out = list(recording.with_role("identify")), list(recording.with_role("validate"))
    if not learned:
        raise InputError(f"{recording.name}: no run has the role identify")
    if not held_out:
        cuts = [int((1 - held_out_share) * run.samples) for run in learned]
        held_out = [run.rows(slice(cut, None)) for run, cut in zip(learned, cuts, strict=True)]
        learned = [run.rows(slice(cut)) for run, cut in zip(learned, cuts, strict=True)]
    return learned, held_out


def _first_fits(runs: Sequence[MotionRun], simulation: ServoSimulation, tuning: MotionTuning) -> list[Array | None]:
    """Numbers, (parameters,) of each joint, by the measured loads; None for a joint that stands still."""
    return [
        None if np.ptp(joint.position) < MIN_MOVED else first_fit(joint, nominal, tuning).values
        for joint, nominal in zip(make_windows(runs, simulation, tuning), simulation.nominal.values, strict=True)
    ]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """Servos that were found, and held-out runs that judge them.

    given: the simulation to be judged. fit, shared: servos, and numbers that all joints share. judged, runs: the
    held-out runs in windows, and whole.
    """

    recording: MotionRecording
    given: ServoSimulation
    fit: ArmFit
    shared: Sequence[FoundNumber]
    judged: Sequence[Windows]
    runs: Sequence[Windows]
    held_out: Sequence[MotionRun]
    tuning: MotionTuning

    def conclude(self) -> MotionDiagnosis:
        """Findings, replays and errors."""
        given, tuning, held_out = self.given, self.tuning, self.held_out
        named = [[] if each is None else self._name(number, each) for number, each in enumerate(self.fit.chosen)]
        known = bool(np.isfinite(self.fit.simulation.nominal.get("kp")).all())
        before = tuple(replay(given, None, held_out)) if known else ()
        simulations = given, self.fit.simulation
        trials = JointTrials(self._is_confirmed, self._with_one_finding)
        chosen, named, servos, after = replay_named(
            simulations, self.fit.chosen, named, trials, before, held_out, tuning
        )
        own = [finding for each in named for finding in each]
        errors = tuple(
            errors_of_joint(number, simulations, servos, windows, before, after, held_out)
            for number, windows in enumerate(self.judged)
        )
        follows = {each.joint: each.follows_command(tuning) for each in errors}
        if not any(follows.values()):
            return MotionDiagnosis(self.recording, given, "inconclusive", NO_SERVO)
        findings = _that_help([*own, *self._shared_findings(replace(self.fit, chosen=chosen), own)], errors, follows)
        status, reason = _status(findings, errors, chosen, tuning.same_error if known else None)
        simulation = replace(self.fit.simulation, nominal=given.nominal, delay=0.0)
        return MotionDiagnosis(
            recording=self.recording,
            simulation=simulation,
            status=status,
            reason=reason,
            chosen=tuple(with_given_nominal(chosen, given)),
            servos=servos,
            findings=tuple(findings),
            errors=errors,
            replayed_before=before,
            replayed_after=after,
            replayed_alone=np.column_stack(
                [stretch_squares(*each, tuning) for each in zip(self.runs, servos.values, strict=True)]
            ),
            tool=(tool_rms(before) if before else None, tool_rms(after)),
            silent=tuple(
                each.joint for each, own in zip(errors, chosen, strict=True) if own is None or not follows[each.joint]
            ),
            currents=correlate_currents(held_out, simulation, servos.values),
            rivals=tuple({} if each is None else self._rivals(number, each) for number, each in enumerate(chosen)),
        )

    def _name(self, number: int, chosen: ChosenServo) -> list[ServoFinding]:
        """The findings of a joint, from 0, that are told."""
        simulation = self.fit.simulation
        windows = self.fit.windows[number], self.judged[number]
        differs = name_differences(number, chosen, simulation, windows, self._mass_error, self.tuning)
        return [each for each in with_given_delay(differs, self.given, simulation.delay) if self._is_told(each)]

    def _rivals(self, number: int, chosen: ChosenServo) -> dict[int, tuple[str, ...]]:
        """What the motion of a joint, from 0, does not tell from each fitted number."""
        return rivals_of_numbers(
            number, chosen, self.fit.simulation, self.fit.windows[number], self._mass_error, self.tuning
        )

    @property
    def _mass_error(self) -> float:
        """Of a mass at the tool that all joints share, kg."""
        return min((each.error for each in self.shared if each.number is TOOL_MASS), default=np.inf)

    def _is_told(self, finding: ServoFinding) -> bool:
        """Whether it is more than the clock of a drive that holds, or of a simulator, makes."""
        controller = self.recording.controller
        holds = controller is not None and controller.rate_hz is not None
        sample = max(1 / run.rate_hz for run in self.held_out) if holds else 0.0
        step = float(self.given.model().opt.timestep)
        return not (finding.is_shorter(sample) or finding.is_lead_of(step))

    def _with_one_finding(
        self, number: int, finding: ServoFinding, chosen: ChosenServo
    ) -> tuple[ChosenServo, list[ServoFinding]]:
        single = chosen.with_one_finding(PARAMETERS.index(finding.parameter), self.fit.windows[number], self.tuning)
        return single, self._name(number, single)

    def _is_confirmed(self, number: int, values: Array) -> bool:
        nominal = with_more(self.given.nominal.values[number], TOOL_MASS.place, -self.fit.simulation.payload)
        without, with_it = (stretch_squares(self.runs[number], each, self.tuning) for each in (nominal, values))
        return rise_of(with_it, without, self.tuning) > self.tuning.clearly_worse

    def _shared_findings(self, fit: ArmFit, own: Sequence[ServoFinding]) -> Iterator[ServoFinding]:
        """Numbers that all joints share and that differ from the simulation's. own: what joints have of their own."""
        findings = list(own)
        for each in self.shared:
            if each.number is TOOL_MASS:
                found = [name_payload(each, fit, self.judged, self.tuning)]
            else:
                delays = name_delay(each, fit, self.judged, findings, self.tuning)
                found = [one for one in delays if self._is_told(one)]
            differing = [one for one in found if not one.holds_nominal]
            findings += differing
            yield from differing


def _that_help(
    findings: Sequence[ServoFinding], errors: Sequence[ReplayError], follows: Mapping[int, bool]
) -> list[ServoFinding]:
    """The findings at joints that follow their command, with which windows and whole runs are replayed better."""
    findings = [each for each in findings if each.parameter.key == TOOL_MASS.key or follows[each.joint]]
    helped = {each.joint for each in errors if each.replay_before is None or each.replay_after < each.replay_before}
    return [each for each in findings if each.after < each.before and _is_at_one_of(each, helped)]


def _is_at_one_of(finding: ServoFinding, joints: Set[int]) -> bool:
    """Whether a finding is at one of these joints; a mass at the tool is at all."""
    return bool(joints) if finding.parameter.key == TOOL_MASS.key else finding.joint in joints


def _status(
    findings: Sequence[ServoFinding],
    errors: Sequence[ReplayError],
    chosen: Sequence[ChosenServo | None],
    same_error: float | None,
) -> tuple[Status, str]:
    if findings:
        return "mismatch", ""
    if same_error is None:
        return "inconclusive", "the simulation has no controller to compare with, and no number stands out"
    worse = [each for each in errors if each.before is not None and each.before > same_error * each.after]
    if worse or any(each is None for each in chosen):
        return "inconclusive", "the simulation replays the motion with an error that no number of the servos explains"
    return "none", ""


def _odd_stretches(
    runs: Sequence[MotionRun], chosen: Sequence[ChosenServo | None], tuning: MotionTuning
) -> list[tuple[str, float, float]]:
    """Run, first and last instant of the windows that the servo of some joint does not explain."""
    stretches = window_stretches(runs, tuning)
    odd = {window for each in chosen if each is not None for window in each.odd.tolist()}
    return sorted(stretches[window] for window in odd)
