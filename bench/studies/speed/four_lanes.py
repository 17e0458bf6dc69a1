"""The fastest build by hand that we know: the formula of the observation matrix, written out as C++ for four samples.

Each operation of CasADi's formula becomes one on a vector of four doubles, straight behind it stands the sum of the
Gram matrix, and the compiler may do what it likes: fused products, another order of sums, sine and cosine of libmvec.
The requirements for development pin CasADi's version.
"""

import shutil
import subprocess
import sysconfig
from collections.abc import Callable
from importlib.metadata import version
from pathlib import Path
from typing import Any

import cffi
import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from bench.studies.speed.casadi_regressor import regressor_function
from problem.arm import Arm
from problem.motion import Motion

GramMatrices = Callable[[Motion], Array]
"""A motion (trajectories, samples, joints) to its Gram matrices (trajectories, chosen, chosen)."""

COMPILER_OPTIONS = ("-O3", "-march=native", "-ffast-math", "-fPIC", "-Wno-psabi")
_LANES = 4
_PROGRAM = """
#include <math.h>
#include <string.h>
typedef double v4 __attribute__((vector_size(32)));

static inline v4 sine(v4 x) {{ v4 y; for (int l = 0; l < 4; l++) y[l] = sin(x[l]); return y; }}
static inline v4 cosine(v4 x) {{ v4 y; for (int l = 0; l < 4; l++) y[l] = cos(x[l]); return y; }}

static inline void regressor(const v4 *q, const v4 *qd, const v4 *qdd, v4 *out) {{
    const v4 *in[3] = {{q, qd, qdd}};
    v4 zero = {{0, 0, 0, 0}};
{lines}
}}

static inline void load(long long left, const double *from, v4 *to) {{
    for (int j = 0; j < {joints}; j++)
        for (int l = 0; l < 4; l++) to[j][l] = l < left ? from[l * {joints} + j] : 0;
}}

static const int first[] = {{{first}}};

extern "C" void gram_matrices(long long trajectories, long long samples, const double *q, const double *qd,
                              const double *qdd, double *gram) {{
    for (long long p = 0; p < trajectories; p++) {{
        v4 sums[{chosen}][{chosen}] = {{}};
        for (long long s = 0; s < samples; s += 4) {{
            long long at = (p * samples + s) * {joints}, left = samples - s;
            v4 a[{joints}], b[{joints}], c[{joints}], rows[{joints}][{chosen}];
            load(left, q + at, a), load(left, qd + at, b), load(left, qdd + at, c);
            regressor(a, b, c, rows[0]);
            if (left < 4)
                for (int i = 0; i < {joints}; i++)
                    for (int k = first[i]; k < {chosen}; k++)
                        for (int l = left; l < 4; l++) rows[i][k][l] = 0;
            for (int i = 0; i < {joints}; i++)
                for (int k = first[i]; k < {chosen}; k++)
                    for (int m = k; m < {chosen}; m++) sums[k][m] += rows[i][k] * rows[i][m];
        }}
        double *out = gram + p * {chosen} * {chosen};
        for (int k = 0; k < {chosen}; k++)
            for (int m = k; m < {chosen}; m++) {{
                v4 v = sums[k][m];
                out[k * {chosen} + m] = out[m * {chosen} + k] = (v[0] + v[1]) + (v[2] + v[3]);
            }}
    }}
}}
"""


def cpp_compiler() -> str | None:
    """The C++ compiler of this machine, if there is one."""
    name = (sysconfig.get_config_var("CXX") or "c++").split()[0]
    return shutil.which(name) or shutil.which("c++")


def describe_build() -> str:
    """CasADi's version, the compiler's and its options, in words; empty without a compiler."""
    compiler = cpp_compiler()
    if compiler is None:
        return ""
    said = subprocess.run([compiler, "--version"], check=True, capture_output=True, text=True).stdout
    return f"CasADi {version('casadi')}, {said.splitlines()[0]}, {' '.join(COMPILER_OPTIONS)}"


def compile_gram_matrices(arm: Arm, columns: NDArray[np.intp], folder: Path) -> GramMatrices:
    """Gram matrices of the chosen columns of an arm's observation matrix, written, compiled and loaded.

    arm: as for `regressor_function`; folder: for the files; a C++ compiler has to be there, see `cpp_compiler`.
    """
    compiler = cpp_compiler()
    assert compiler is not None
    source, library = folder / "four_lanes.cpp", folder / "four_lanes.so"
    compiled = folder / "four_lanes.o"
    source.write_text(_program(regressor_function(arm, columns), len(arm), columns))
    subprocess.run([compiler, *COMPILER_OPTIONS, "-c", str(source), "-o", str(compiled)], check=True)
    # linked without -ffast-math, which would make the whole process flush subnormal numbers to zero
    subprocess.run([compiler, "-shared", str(compiled), "-o", str(library), "-lm"], check=True)
    ffi = cffi.FFI()
    ffi.cdef("void gram_matrices(long long, long long, const double *, const double *, const double *, double *);")
    run, chosen = ffi.dlopen(str(library)).gram_matrices, len(columns)
    at, numbers = ffi.from_buffer, ffi.typeof("double *")

    def gram_matrices(motion: Motion) -> Array:
        q, qd, qdd = motion.position, motion.velocity, motion.acceleration
        trajectories, samples, _ = q.shape
        out = np.empty((trajectories, chosen, chosen))
        run(trajectories, samples, at(numbers, q), at(numbers, qd), at(numbers, qdd), at(numbers, out))
        return out

    return gram_matrices


def _program(function: Any, joints: int, columns: NDArray[np.intp]) -> str:
    first = np.searchsorted(columns, 10 * np.arange(joints))
    return _PROGRAM.format(
        lines="\n".join(_lines(function)), joints=joints, chosen=len(columns), first=", ".join(map(str, first))
    )


def _lines(function: Any) -> list[str]:
    """One line of C++ for each operation of a CasADi function."""
    import casadi

    forms = {
        casadi.OP_ADD: "{} + {}",
        casadi.OP_SUB: "{} - {}",
        casadi.OP_MUL: "{} * {}",
        casadi.OP_NEG: "-{}",
        casadi.OP_SQ: "{0} * {0}",
        casadi.OP_TWICE: "{0} + {0}",
        casadi.OP_SIN: "sine({})",
        casadi.OP_COS: "cosine({})",
    }
    lines = []
    names: dict[int, str] = {}  # of the last value in each place of the work vector
    for number in range(function.n_instructions()):
        operation = function.instruction_id(number)
        inputs, outputs = function.instruction_input(number), function.instruction_output(number)
        if operation == casadi.OP_OUTPUT:
            lines.append(f"    out[{outputs[1]}] = {names[inputs[0]]};")
            continue
        if operation == casadi.OP_CONST:
            value = f"zero + {function.instruction_constant(number)!r}"
        elif operation == casadi.OP_INPUT:
            value = f"in[{inputs[0]}][{inputs[1]}]"
        else:
            value = forms[operation].format(*(names[place] for place in inputs))
        names[outputs[0]] = f"x{number}"
        lines.append(f"    const v4 x{number} = {value};")
    return lines
