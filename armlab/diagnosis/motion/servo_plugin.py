"""The servos of a diagnosis in a simulation of MuJoCo: the torque that no field of MJCF holds, added at run time.

A copy of this file stands beside each verdict, with the numbers in `servos.json`; it needs MuJoCo and NumPy alone:

    model = mujoco.MjModel.from_xml_path("arm.xml")
    with servo_plugin.installed(model, servo_plugin.read_servos("servos.json")):
        data.ctrl[:] = command  # rad (m), as without the plug-in
        mujoco.mj_step(model, data)

The law of a joint, with q and qd as MuJoCo has them and c the command that held at a time:

    torque = s clip((kp - ki_speed) e - kd qd + i, -most, most)
    most   = limit - limit_slope |qd| where the drive does work, limit where it brakes
    e      = d(c(t - delay) + offset - q),  d(x) = sgn(x) max(|x| - dead_band / 2, 0)
    i'     = ki e - ki_speed qd,  |i| <= integral_limit
    friction loss = friction + static_excess exp(-(qd / stribeck_speed)^2) + load_friction |gear|

gear is the torque that moves and holds the links, mj_rne with the accelerations of the step before.

kp, kd, limit, damping, friction and armature are written into the model. A callback (`mujoco.set_mjcb_passive`) adds
to `qfrc_passive` what the torque of the law has more than that of the actuator, and sets the friction loss of the next
step. `data.ctrl` stays the user's. One plug-in serves one MjData at a time; `mj_resetData` empties its history and its
integrals.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

STICKING = (0.9999, 0.9999, 0.001, 0.5, 2.0)  # solimp of a friction loss that holds at rest; MuJoCo's own slips
DRIVE = ("kp", "kd", "ki", "ki_speed", "integral_limit", "limit", "limit_slope", "delay", "offset", "dead_band")
LAW = (*DRIVE, "friction", "load_friction", "static_excess", "stribeck_speed")
NUMBERS = (*LAW, "damping", "armature")
SAME_TIME_S = 1e-9  # below it two instants are one
JOINT_TRANSMISSION = 0  # mjTRN_JOINT


def read_servos(path: str | Path) -> dict[str, Any]:
    """The content of `servos.json`: one entry of `servos` a joint, and `rate_hz`, null where commands are not held."""
    content: dict[str, Any] = json.loads(Path(path).read_text(encoding="utf-8"))
    return content


def find_actuator(model: Any, joint: int) -> int | None:
    """The first actuator that drives a joint, both from 0; None where none does."""
    found = np.flatnonzero((model.actuator_trnid[:, 0] == joint) & (model.actuator_trntype == JOINT_TRANSMISSION))
    return int(found[0]) if len(found) else None


def set_fields(model: Any, joint: int, actuator: int, servo: Mapping[str, Any]) -> None:
    """Writes what the fields of a model hold of a servo: gains and force range, friction that sticks, damping, rotor.

    joint, actuator: from 0. servo: SI units; a limit of None is no limit. The actuator is not late.
    """
    dof, kp, kd, limit = model.jnt_dofadr[joint], servo["kp"], servo["kd"], servo["limit"]
    model.actuator_gainprm[actuator, 0] = kp
    model.actuator_biasprm[actuator, :3] = 0.0, -kp, -kd
    model.actuator_forcelimited[actuator] = limit is not None
    if limit is not None:
        model.actuator_forcerange[actuator] = -limit, limit
    model.actuator_delay[actuator] = 0.0
    model.dof_damping[dof] = servo["damping"]
    model.dof_frictionloss[dof] = servo["friction"]
    model.dof_armature[dof] = servo["armature"]
    model.dof_solimp[dof] = STICKING


class ServoPlugin:
    """The callback of the servos of a model: `mujoco.set_mjcb_passive(plugin)`, or `installed`.

    model: mujoco.MjModel with a position actuator of gear 1 at each joint of servos; its fields are set. servos: as
    `servos.json` has them. Raises ValueError for a joint that the model does not have, or without such an actuator.
    supply: voltage over its nominal value, which scales the drives; set it where it varies. integral: what the drives
    hold before the next step, (servos,), N m; set it where they do not start empty.
    """

    def __init__(self, model: Any, servos: Mapping[str, Any]) -> None:
        entries: Sequence[Mapping[str, Any]] = servos["servos"]
        joints = [_find_joint(model, entry["joint"]) for entry in entries]
        self.supply = 1.0
        self.integral = np.zeros(len(entries))
        self._begun: tuple[float, Any] = (-np.inf, self.integral)  # time of a step, and the integrals before it
        self._rate_hz: float | None = servos.get("rate_hz")
        self._actuators = np.array([_servo_actuator(model, joint) for joint in joints], dtype=np.intp)
        self._positions, self._dofs = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        for joint, actuator, entry in zip(joints, self._actuators.tolist(), entries, strict=True):
            set_fields(model, joint, actuator, entry)
        self._law = {
            key: np.array([np.inf if entry[key] is None else entry[key] for entry in entries], dtype=float)
            for key in LAW
        }
        self._started = np.inf  # time of the first evaluation
        self._times: list[float] = []
        self._commands: list[Any] = []
        self._load = np.zeros(model.nv)

    def __call__(self, model: Any, data: Any) -> None:
        """Adds the missing torque to `data.qfrc_passive`; called by MuJoCo once for each evaluation of the forces."""
        import mujoco

        law, position, velocity = self._law, data.qpos[self._positions], data.qvel[self._dofs]
        command = _clamped_command(model, data, self._actuators)
        self._remember(data.time, data.ctrl[self._actuators])
        error = self._held_commands(data.time) + law["offset"] - position
        error -= np.clip(error, -law["dead_band"] / 2, law["dead_band"] / 2)
        self._integrate(data.time, model.opt.timestep, law["ki"] * error - law["ki_speed"] * velocity)
        drive = (law["kp"] - law["ki_speed"]) * error - law["kd"] * velocity + self.integral
        less = np.where(drive * velocity > 0, law["limit_slope"] * np.abs(velocity), 0.0)
        most = np.maximum(law["limit"] - less, 0.0)
        drive = np.clip(drive, -most, most)
        actuator = law["kp"] * (command - position) - law["kd"] * velocity
        actuator = np.clip(actuator, -law["limit"], law["limit"])
        data.qfrc_passive[self._dofs] += self.supply * drive - actuator
        if law["load_friction"].any() or law["static_excess"].any():
            has_moved = data.time > self._started + SAME_TIME_S
            mujoco.mj_rne(model, data, int(has_moved), self._load)
            static = law["static_excess"] * np.exp(-((velocity / law["stribeck_speed"]) ** 2))
            loaded = law["load_friction"] * np.abs(self._load[self._dofs])
            model.dof_frictionloss[self._dofs] = law["friction"] + static + loaded

    def _integrate(self, time: float, step: float, rate: Any) -> None:
        """The integrals at the end of a step; an evaluation at the time of the last one replaces its result.

        rate: their growth, (servos,), N m/s.
        """
        if time > self._begun[0] + SAME_TIME_S:
            self._begun = time, self.integral
        limit = self._law["integral_limit"]
        self.integral = np.clip(self._begun[1] + step * rate, -limit, limit)

    def _remember(self, time: float, command: Any) -> None:
        self._started = min(self._started, time)
        if self._times and time < self._times[-1] - SAME_TIME_S:
            self._times, self._commands, self._started = [], [], time
            self._begun = (-np.inf, np.zeros_like(self.integral))
            self.integral = self._begun[1]
        if self._times and np.array_equal(command, self._commands[-1]):
            return
        if self._times and time < self._times[-1] + SAME_TIME_S:
            self._commands[-1] = command.copy()
            return
        self._times.append(time)
        self._commands.append(command.copy())
        oldest = time - self._law["delay"].max() - (1 / self._rate_hz if self._rate_hz else 0.0)
        while len(self._times) > 1 and self._times[1] < oldest - SAME_TIME_S:
            del self._times[0], self._commands[0]

    def _held_commands(self, time: float) -> Any:
        """The command of each servo that its law sees now: late, and taken over at the rate of the controller."""
        wanted = time - self._law["delay"]
        if self._rate_hz:
            wanted = np.floor(wanted * self._rate_hz + SAME_TIME_S) / self._rate_hz
        rows = np.searchsorted(self._times, wanted + SAME_TIME_S, side="right") - 1
        return np.array(self._commands)[np.maximum(rows, 0), np.arange(len(rows))]


@contextmanager
def installed(model: Any, servos: Mapping[str, Any]) -> Iterator[ServoPlugin]:
    """The plug-in as the passive callback of MuJoCo, until the block ends; the callback of before comes back."""
    import mujoco

    plugin, before = ServoPlugin(model, servos), mujoco.get_mjcb_passive()
    mujoco.set_mjcb_passive(plugin)
    try:
        yield plugin
    finally:
        mujoco.set_mjcb_passive(before)


def _find_joint(model: Any, name: str) -> int:
    known = [model.joint(number).name for number in range(model.njnt)]
    if name not in known:
        raise ValueError(f"the model has no joint '{name}', only {', '.join(known)}")
    return known.index(name)


def _servo_actuator(model: Any, joint: int) -> int:
    actuator, name = find_actuator(model, joint), model.joint(joint).name
    if actuator is None:
        raise ValueError(f"joint '{name}' has no actuator: give it a position actuator")
    kinds = int(model.actuator_gaintype[actuator]), int(model.actuator_biastype[actuator])
    if kinds != (0, 1) or model.actuator_gear[actuator, 0] != 1 or model.actuator_dyntype[actuator] != 0:
        raise ValueError(f"the actuator of joint '{name}' is no position actuator with gear 1")
    return actuator


def _clamped_command(model: Any, data: Any, actuators: Any) -> Any:
    """The command that the actuators see: within their control range, unless MuJoCo's flag switches that off."""
    import mujoco

    command = data.ctrl[actuators]
    if model.opt.disableflags & int(mujoco.mjtDisableBit.mjDSBL_CLAMPCTRL):
        return command
    low, high = model.actuator_ctrlrange[actuators].T
    limited = model.actuator_ctrllimited[actuators].astype(bool)
    return np.where(limited, np.clip(command, low, high), command)
