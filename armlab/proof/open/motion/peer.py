"""mujoco.sysid (DeepMind) beside armlab: the same free numbers of the servos, start, bounds and windows for both.

Both minimise the squares of simulated minus measured position, rad, over windows that start from the measured state.
armlab replays each joint alone, the others where they were measured; mujoco.sysid replays the whole arm and fits the
numbers of all joints at once. It has what its documentation recommends: its optimiser `mujoco`, Gauss-Newton with
batched, multithreaded rollouts. Where its defaults would be worse for it, it has what armlab's fit has: coordinates and
their scales (`to_coordinates`), large finite differences, a tolerance of 1e-5, errors that are not divided by the size
of a window's motion, a friction loss that sticks. Its models are copied, not compiled anew for each column of the
Jacobian. A delay shifts the simulated position; an offset is a constant torque of the drive. A number that no field of
MuJoCo holds is left out for both.
"""

import copy
import io
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from armlab.common.packages import install_line
from armlab.diagnosis.motion.diagnose_motion import split_runs
from armlab.diagnosis.motion.estimate import LOGARITHMIC, find_start, from_coordinates, to_coordinates
from armlab.diagnosis.motion.motion_result import MotionDiagnosis
from armlab.diagnosis.motion.motion_tuning import DEFAULT, MotionTuning
from armlab.diagnosis.motion.replay import Replayed, replay, with_servos
from armlab.diagnosis.motion.servo import HIGHEST, KEYS, LOWEST, SCALE, Servos
from armlab.diagnosis.motion.servo_plugin import STICKING
from armlab.diagnosis.motion.servo_simulation import ServoSimulation, actuator_of
from armlab.diagnosis.motion.windows import held_command, make_windows, smooth_motion, window_stretches
from armlab.recordings.recording import MotionRun
from problem.mjcf import import_mujoco

WINDOWS = 24  # all of the SO-101's would take mujoco.sysid most of an hour on two processors
NO_FIELD = ("limit_slope", "dead_band", "load_friction", "static_excess")
DIFFERENCE = 1e-3  # of a coordinate; with the default of 1.5e-8 the fit stopped after 3 iterations on 24 windows
SAME_COST = 1.01  # times the last cost: what comes after it need not be charged


@dataclass(frozen=True, eq=False)
class ServoTask:
    """What both are given.

    runs: those that identify. windows: places of the windows that both fit, among all of these runs (`stretches`: run,
    first and last instant). held_out: the runs that judge. start: numbers of the simulation. free: (joints,
    parameters), which of them are fitted.
    """

    simulation: ServoSimulation
    runs: tuple[MotionRun, ...]
    stretches: tuple[tuple[str, float, float], ...]
    windows: NDArray[np.intp]
    held_out: tuple[MotionRun, ...]
    start: Servos
    free: NDArray[np.bool_]

    @property
    def chosen(self) -> list[tuple[str, float, float]]:
        """Run, first and last instant of each window that both fit."""
        return [self.stretches[number] for number in self.windows]

    @property
    def seconds(self) -> float:
        """Length of the windows that both fit."""
        return sum(last - first for _, first, last in self.chosen)


@dataclass(frozen=True, eq=False)
class TimedFit:
    """Numbers that were found, the time it took, and the held-out runs replayed with them.

    processor_seconds: of all threads; None where it was not measured.
    """

    servos: Servos
    seconds: float
    processor_seconds: float | None
    replayed: tuple[Replayed, ...]


@dataclass(frozen=True, eq=False)
class SysidFit:
    """What mujoco.sysid found. reached: seconds until its cost was within 1 % of the last one. ended: its own words."""

    servos: Servos
    iterations: int
    reached: float
    ended: str


@dataclass(frozen=True, eq=False)
class PeerComparison:
    """armlab and mujoco.sysid on one task.

    diagnosis: armlab's diagnosis of all windows, which chooses the numbers. alone: armlab's fit of these numbers on the
    windows of the task. peer: mujoco.sysid's fit of the same, with what it tells in sysid.
    """

    task: ServoTask
    diagnosis: TimedFit
    alone: TimedFit
    peer: TimedFit
    sysid: SysidFit


def compare_with_sysid(
    diagnosis: MotionDiagnosis,
    count: int = WINDOWS,
    progress: Callable[[str], None] = lambda message: None,
    tuning: MotionTuning = DEFAULT,
) -> PeerComparison:
    """armlab and mujoco.sysid on some windows, one after the other, judged by the same replay of the held-out runs.

    diagnosis: of the whole recording; what it fitted on each joint is free. count: windows, spread evenly over those in
    which no joint is odd. Raises InputError where mujoco.sysid is missing, or the simulation has no number to start
    from.
    """
    import_sysid()
    task = servo_task(diagnosis, count, tuning)
    assert diagnosis.servos is not None
    fits: list[SysidFit] = []

    def fit_peer() -> Servos:
        fits.append(fit_with_sysid(task, tuning))
        return fits[-1].servos

    def timed(name: str, fit: Callable[[], Servos]) -> TimedFit:
        progress(f"{name}: {len(task.windows)} windows")
        began, processor = time.perf_counter(), time.process_time()
        servos = fit()
        seconds, processor_seconds = time.perf_counter() - began, time.process_time() - processor
        return TimedFit(servos, seconds, processor_seconds, tuple(replay(task.simulation, servos, task.held_out)))

    return PeerComparison(
        task=task,
        diagnosis=TimedFit(diagnosis.servos, diagnosis.seconds, None, diagnosis.replayed_after),
        alone=timed("fit by armlab", lambda: fit_joints(task, tuning)),
        peer=timed("fit by mujoco.sysid", fit_peer),
        sysid=fits[0],
    )


def import_sysid() -> Any:
    """mujoco.sysid; InputError, with the command that installs it, where it or a package that it needs is missing."""
    import_mujoco()
    try:
        from mujoco import sysid
    except ImportError:
        sysid = None
    if not hasattr(sysid, "optimize"):  # without the packages that it needs it imports, and is empty
        raise InputError(f"mujoco.sysid is missing, which --peer sysid needs: {install_line('peers')}")
    return sysid


def servo_task(diagnosis: MotionDiagnosis, count: int, tuning: MotionTuning = DEFAULT) -> ServoTask:
    """Some windows of the runs that identify, with the numbers free that the diagnosis fitted on each joint."""
    if diagnosis.servos is None:
        raise InputError(f"the diagnosis of {diagnosis.recording.name} found no servo: there is nothing to compare")
    learned, held_out = split_runs(diagnosis.recording, tuning.held_out_share)
    stretches = tuple(window_stretches(learned, tuning))
    odd = [number for chosen in diagnosis.chosen if chosen is not None for number in chosen.odd.tolist()]
    sound = np.setdiff1d(np.arange(len(stretches)), odd)
    spread = np.unique(np.linspace(0, len(sound) - 1, min(count, len(sound))).astype(int))
    start = diagnosis.simulation.nominal.values.copy()
    free = np.zeros(start.shape, dtype=bool)
    for row, chosen in enumerate(diagnosis.chosen):
        if chosen is not None:
            start[row], free[row] = chosen.nominal, chosen.free
    free[:, [KEYS.index(key) for key in NO_FIELD]] = False
    if not np.isfinite(start).all():
        raise InputError("the simulation has no controller: mujoco.sysid has no number to start from")
    return ServoTask(
        diagnosis.simulation, tuple(learned), stretches, sound[spread], tuple(held_out), Servos(start), free
    )


def fit_joints(task: ServoTask, tuning: MotionTuning = DEFAULT) -> Servos:
    """armlab's fit of the free numbers, joint by joint; the others keep their start."""
    values = task.start.values.copy()
    for row, windows in enumerate(make_windows(task.runs, task.simulation, tuning)):
        if task.free[row].any():
            values[row] = find_start(windows.select(task.windows), values[row], task.free[row], tuning).values
    return Servos(values)


def fit_with_sysid(task: ServoTask, tuning: MotionTuning = DEFAULT) -> SysidFit:
    """mujoco.sysid's fit of the free numbers of all joints, with as many iterations as a fit of armlab."""
    sysid = import_sysid()
    model, spec = _bare_model(task.simulation)
    scale = np.broadcast_to(np.where(LOGARITHMIC, 0.2, SCALE), task.free.shape)[task.free]

    def build_model(parameters: Any, _: Any) -> Any:
        return _with_values(copy.copy(model), task, parameters)

    def position_errors(parameters: Any, _: Any, measured: Any, *__: Any, state: Array, **___: Any) -> tuple[Any, ...]:
        delay = _servos_of(task, parameters).get("delay")
        simulated = [
            np.interp(measured.times + task.simulation.read_delay[row] - delay[row], state[:, 0], state[:, 1 + joint])
            for row, joint in enumerate(task.simulation.joints)
        ]
        return np.stack(simulated, axis=1) - measured.data, measured, measured

    residual = sysid.build_residual_fn(
        models_sequences=[_measured_windows(sysid, task, model, spec, tuning)],
        build_model=build_model,
        modify_residual=position_errors,
        resample_true=False,
    )
    began, costs, printed = time.perf_counter(), [(0.0, np.inf)], io.StringIO()

    def note_cost(trace: Sequence[Any]) -> None:
        costs.append((time.perf_counter() - began, float(trace[-1].objective - trace[-1].reduction)))

    found, _ = sysid.optimize(
        _parameters(sysid, task),
        residual,
        optimizer="mujoco",
        verbose=False,
        x_scale=scale,
        eps=DIFFERENCE,
        xtol=1e-5,
        max_iters=tuning.max_evaluations,
        iter_callback=note_cost,
        output=printed,
    )
    reached = next(seconds for seconds, cost in costs if cost <= SAME_COST * costs[-1][1])
    words = next(line for line in printed.getvalue().splitlines() if line.startswith("Terminated"))
    return SysidFit(_servos_of(task, found), len(costs) - 2, reached, words.split(": ")[1].split(".")[0])


def _bare_model(simulation: ServoSimulation) -> tuple[Any, Any]:
    """The arm as `replay` has it, without contact and limits, joints that were not recorded held, and its spec."""
    mujoco = import_mujoco()
    spec, flags = simulation.spec(), mujoco.mjtDisableBit
    spec.option.disableflags |= int(flags.mjDSBL_LIMIT) | int(flags.mjDSBL_CONTACT) | int(flags.mjDSBL_CLAMPCTRL)
    for joint in simulation.joints:
        name, kind = simulation.arm.joints[joint].name, mujoco.mjtSensor.mjSENS_JOINTPOS
        spec.add_sensor(name=f"{name}-position", type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name)
    model = spec.compile()
    others = sorted(set(range(model.nv)) - set(simulation.joints))
    model.dof_frictionloss[others], model.dof_solimp[others] = 1e3, STICKING
    return model, spec


def _parameters(sysid: Any, task: ServoTask) -> Any:
    """The free numbers as coordinates with armlab's bounds."""
    start, low, high = (to_coordinates(values) for values in (task.start.values, LOWEST, HIGHEST))
    parameters = sysid.ParameterDict()
    for row, column in np.argwhere(task.free).tolist():
        value = np.clip(start[row, column], low[column], high[column])
        parameters.add(sysid.Parameter(f"{row + 1} {KEYS[column]}", value, low[column], high[column]))
    return parameters


def _servos_of(task: ServoTask, parameters: Any) -> Servos:
    coordinates = to_coordinates(task.start.values)
    coordinates[task.free] = parameters.as_vector()
    return Servos(np.where(task.free, from_coordinates(coordinates), task.start.values))


def _with_values(model: Any, task: ServoTask, parameters: Any) -> Any:
    """The model with the numbers of a step of the optimiser."""
    servos = _servos_of(task, parameters)
    with_servos(model, task.simulation, servos)
    drives = [actuator_of(model, joint) for joint in task.simulation.joints]
    model.actuator_biasprm[drives, 0] = servos.get("kp") * servos.get("offset")
    return model


def _measured_windows(sysid: Any, task: ServoTask, model: Any, spec: Any, tuning: MotionTuning) -> Any:
    """The windows of armlab's fit as mujoco.sysid takes them: first states, held commands, measured positions."""
    joints, runs = list(task.simulation.joints), {run.name: run for run in task.runs}
    motions = {
        name: smooth_motion(runs[name], task.simulation.read_delay, tuning)
        for name in {name for name, _, _ in task.chosen}
    }
    names, states, controls, positions = [], [], [], []
    for name, first, last in task.chosen:
        run = runs[name]
        rows = np.flatnonzero((run.time >= first) & (run.time <= last))
        position, velocity = np.zeros(model.nq), np.zeros(model.nv)
        position[joints], velocity[joints] = run.position[rows[0]], motions[name].velocity[rows[0]]
        steps = int(np.ceil((last - first) / model.opt.timestep)) + 1
        since = model.opt.timestep * np.arange(steps)
        control = np.zeros((steps, model.nu))
        for row, joint in enumerate(joints):
            control[:, actuator_of(model, joint)] = held_command(run, row, first + since, task.simulation.rate_hz)
        names.append(f"{name} {first:g} s")
        states.append(sysid.create_initial_state(model, position, velocity))
        controls.append(sysid.TimeSeries.from_control_names(since, control, model))
        positions.append(sysid.TimeSeries.from_names(run.time[rows[1:]] - first, run.position[rows[1:]], model))
    return sysid.ModelSequences(task.simulation.arm.name, spec, names, states, controls, positions)
