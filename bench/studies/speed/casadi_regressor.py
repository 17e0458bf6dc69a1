"""The observation matrix as a practitioner would make it fast: its formula in CasADi, generated as C and compiled.

Each link j has the wrench A_j phi_j about its own origin (eq. 29-31):

    f = m a + (S(dw) + S(w) S(w)) mc              with S(x) y = x cross y
    n = -S(a) mc + (L(dw) + S(w) L(w)) I          with L(x) (Ixx .. Iyz) = I x

carried from frame to frame towards the base; the row of joint i is what arrives at its axis. CasADi finds the common
subexpressions, and the compiler has -O3 -march=native.
"""

import shutil
import subprocess
import sysconfig
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.common.errors import InputError
from problem.arm import Arm
from problem.motion import Motion

Regressor = Callable[[Motion], Array]
"""A motion (.., samples, joints) to its observation matrix (.., samples * joints, chosen)."""

_ROUNDED_TO_ZERO = 1e-15  # entries of a fixed rotation that are zero but for rounding
COMPILER_OPTIONS = ("-O3", "-march=native", "-shared", "-fPIC")
_LOOP = """
void observation_matrices(long long samples, const double *q, const double *qd, const double *qdd, double *out) {{
    const double *arg[{arguments}];
    double *res[{results}], work[{work}];
    long long whole[{whole}];
    for (long long s = 0; s < samples; s++) {{
        arg[0] = q + s * {joints}, arg[1] = qd + s * {joints}, arg[2] = qdd + s * {joints};
        res[0] = out + s * {entries};
        regressor(arg, res, whole, work, 0);
    }}
}}
"""


def compile_regressor(arm: Arm, columns: NDArray[np.intp], folder: Path) -> Regressor:
    """The chosen columns of an arm's observation matrix, generated, compiled and loaded; folder: for its files.

    arm: of revolute joints, with the frames of its links at the joints. Raises InputError without a C compiler.
    """
    function = regressor_function(arm, columns)
    source, library = folder / "regressor.c", folder / "regressor.so"
    source.write_text(_c_code(function, len(arm), len(columns)))
    subprocess.run([_compiler(), *COMPILER_OPTIONS, str(source), "-o", str(library), "-lm"], check=True)
    ffi = cffi.FFI()
    ffi.cdef("void observation_matrices(long long, const double *, const double *, const double *, double *);")
    run = ffi.dlopen(str(library)).observation_matrices

    def observe(motion: Motion) -> Array:
        out = np.empty((*motion.batch, motion.samples * motion.joints, len(columns)))
        states = (motion.position, motion.velocity, motion.acceleration)
        pointers = [ffi.from_buffer("double *", array) for array in (*states, out)]
        run(motion.position.size // motion.joints, *pointers)
        return out

    return observe


def regressor_function(arm: Arm, columns: NDArray[np.intp]) -> Any:
    """CasADi's function of q, qd, qdd (joints,): the chosen columns (chosen, joints), transposed for C's order."""
    import casadi

    q, qd, qdd = (casadi.SX.sym(name, len(arm)) for name in ("q", "qd", "qdd"))
    rows: list[list[Any]] = [[casadi.SX.zeros(1, 10) for _ in arm.joints] for _ in arm.joints]
    w, dw = casadi.SX.zeros(3), casadi.SX.zeros(3)
    a = casadi.DM([-value for value in arm.gravity])
    axis = casadi.DM([0, 0, 1])
    placements = []
    for j, joint in enumerate(arm.joints):
        if joint.kind != "revolute" or not np.array_equal(joint.after, np.eye(4)):
            raise InputError(f"'{arm.name}', {joint.name}: should be revolute, with the link's frame at the joint")
        shift, turn = casadi.DM(joint.before[:3, 3]), _rotation(joint.before[:3, :3], q[j])
        a = turn.T @ (a + casadi.cross(dw, shift) + casadi.cross(w, casadi.cross(w, shift)))
        w, dw = turn.T @ w, turn.T @ dw
        dw = dw + axis * qdd[j] + casadi.cross(w, axis * qd[j])
        w = w + axis * qd[j]
        placements.append((turn, shift))
        force, moment = _wrench(a, w, dw)
        for i in range(j, -1, -1):
            rows[i][j] = moment[2, :]
            turn, shift = placements[i]
            force, moment = turn @ force, turn @ moment
            moment = moment + casadi.skew(shift) @ force
    matrix = casadi.vertcat(*(casadi.horzcat(*row) for row in rows))[:, [int(column) for column in columns]]
    return casadi.Function("regressor", [q, qd, qdd], [casadi.densify(matrix.T)], {"cse": True})


def _rotation(before: Array, angle: Any) -> Any:
    """before @ Rz(angle), with the zeros of the fixed rotation left out."""
    import casadi

    cosine, sine = casadi.cos(angle), casadi.sin(angle)
    about_z = casadi.vertcat(casadi.horzcat(cosine, -sine, 0), casadi.horzcat(sine, cosine, 0), casadi.DM([0, 0, 1]).T)
    return casadi.sparsify(casadi.DM(before), _ROUNDED_TO_ZERO) @ about_z


def _wrench(a: Any, w: Any, dw: Any) -> tuple[Any, Any]:
    """Force and moment about the origin of the link's frame, (3, 10) each: columns of eq. 31."""
    import casadi

    spin = casadi.skew(w)
    force = casadi.horzcat(a, casadi.skew(dw) + spin @ spin, casadi.SX.zeros(3, 6))
    moment = casadi.horzcat(casadi.SX.zeros(3), -casadi.skew(a), _inertia_times(dw) + spin @ _inertia_times(w))
    return force, moment


def _inertia_times(x: Any) -> Any:
    """L(x), (3, 6): what (Ixx, Iyy, Izz, Ixy, Ixz, Iyz) are multiplied by in I x."""
    import casadi

    return casadi.vertcat(
        casadi.horzcat(x[0], 0, 0, x[1], x[2], 0),
        casadi.horzcat(0, x[1], 0, x[0], 0, x[2]),
        casadi.horzcat(0, 0, x[2], 0, x[0], x[1]),
    )


def _c_code(function: Any, joints: int, chosen: int) -> str:
    """The generated function, and a loop over samples behind it."""
    import casadi

    generator = casadi.CodeGenerator("regressor.c")
    generator.add(function)
    sizes = {
        "arguments": function.sz_arg(),
        "results": function.sz_res(),
        "work": max(function.sz_w(), 1),
        "whole": max(function.sz_iw(), 1),
    }
    code: str = generator.dump()
    return code + _LOOP.format(**sizes, joints=joints, entries=joints * chosen)


def _compiler() -> str:
    name = (sysconfig.get_config_var("CC") or "cc").split()[0]
    found = shutil.which(name) or shutil.which("cc")
    if found is None:
        raise InputError("the speed of CasADi's C code needs a C compiler: install gcc or clang")
    return found
