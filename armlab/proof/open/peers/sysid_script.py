"""Runs mujoco.sysid: `sysid_script.py RUNS MJCF OUT`, in an environment that has it.

Its pseudo-inertia parameters of each body and armatures in the model, viscous and Coulomb friction and offset beside
it; its optimiser on the error of the inverse dynamics, through the shared filter.
"""

import sys
import time
from functools import partial
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from armlab.common.arrays import Array
from armlab.proof.open.peers.exchange import PeerRun, read_runs, write_answer

FIT_ROWS_PER_CUTOFF = 10  # rows in a period of the cut-off, at which a fit looks
MAX_ITERATIONS = 60
MAX_PARAMETER = (
    500.0  # N m (N), its s/rad and its s2/rad: the bound of friction, offset and armature, in units of the torque
)


def sysid_parameters(spec: Any, model: Any, torque: Array) -> Any:
    """All parameters of the arm and its joints, wide bounds."""
    parameters, joints = sysid.ParameterDict(), model.nv
    for number in range(1, joints + 1):
        body = sysid.body_inertia_param(
            spec,
            model,
            f"link{number}",
            sysid.InertiaType.Pseudo,
            mass_bound_mult=np.array([0.01, 100.0]),
            ipos_bound_off=np.array([-1.0, 1.0]),
            stretch_bound_mult=np.array([0.05, 20.0]),
            shear_bound_off=np.array([-2.0, 2.0]),
            modifier=partial(_set_body, name=f"link{number}"),
        )
        parameters.add(body)
    size = float(np.sqrt(np.mean(torque**2)))
    for name, least in (("armature", 0.0), ("viscous", 0.0), ("coulomb", 0.0), ("offset", -MAX_PARAMETER * size)):
        start, low, high = np.full(joints, 0.02 * size), np.full(joints, least), np.full(joints, MAX_PARAMETER * size)
        modify = _set_armatures if name == "armature" else None
        parameters.add(sysid.Parameter(name, start, low, high, modifier=modify))
    return parameters


def _set_body(spec: Any, parameter: Any, name: str) -> None:
    """sysid's own, but MuJoCo 4.0 refuses the turn of the principal axes that it leaves undefined."""
    sysid.apply_body_inertia(spec, name, parameter)
    spec.body(name).iquat = [1.0, 0.0, 0.0, 0.0]


def _set_armatures(spec: Any, parameter: Any) -> None:
    for joint, value in zip(spec.joints, parameter.value, strict=True):
        joint.armature = float(value)


def torque_of(spec: Any, values: Any, run: PeerRun) -> Array:
    """Filtered torque of a run, (kept, joints)."""
    model = sysid.apply_param_modifiers(values, spec)
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_CONSTRAINT
    data, out = mujoco.MjData(model), np.empty_like(run.position)
    for row, (q, qd, qdd) in enumerate(zip(run.position, run.velocity, run.acceleration, strict=True)):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, qdd
        mujoco.mj_inverse(model, data)
        out[row] = data.qfrc_inverse
    viscous = values["viscous"].value
    coulomb = values["coulomb"].value
    offset = values["offset"].value
    return run.low_pass(out + viscous * run.velocity + coulomb * np.sign(run.velocity) + offset)


def main(runs_file: str, mjcf: str, out: str) -> None:
    """Fits the run that identifies and predicts all."""
    runs = list(read_runs(Path(runs_file)))
    started = time.process_time()
    whole = next(run for run in runs if run.role == "identify")
    fitted = whole.thinned(max(int(whole.rate_hz / (FIT_ROWS_PER_CUTOFF * whole.cutoff_hz)), 1))
    spec = mujoco.MjSpec.from_file(mjcf)
    spec.compiler.balanceinertia = True  # light bodies fail the triangle inequality by rounding
    target = fitted.torque[fitted.low_pass.rows]
    start = sysid_parameters(spec, spec.compile(), target)
    scale = 1 / np.std(target, axis=0)

    def error(vector: Array, values: Any) -> Array:
        values.update_from_vector(vector)
        return np.asarray(((torque_of(spec, values, fitted) - target) * scale).ravel())

    def residual(vectors: Array, values: Any) -> tuple[list[Array], None, None]:
        if vectors.ndim == 1:
            return [error(vectors, values)], None, None
        return [np.column_stack([error(vector, values) for vector in vectors.T])], None, None

    fitted, _ = sysid.optimize(start, residual, optimizer="mujoco", verbose=False, max_iters=MAX_ITERATIONS)
    seconds = time.process_time() - started
    write_answer({run.name: torque_of(spec, fitted, run) for run in runs}, seconds, Path(out))


if __name__ == "__main__":
    main(*sys.argv[1:])
