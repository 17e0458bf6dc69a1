"""Defects that the regression check is tried on.

A context puts a defect into the running code and takes it out again; searches run within it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType
from unittest.mock import patch

import numpy as np
from joblib import Parallel, delayed, parallel_config
from numpy.typing import NDArray

from algorithms.contract import as_loss
from algorithms.de import DE, DEState
from algorithms.spso import Swarm, fly
from armlab.common.arrays import Array
from bench.execute import Outcome, Trial, run_trial
from bench.plan import Entry
from bench.studies.regression.sweep import Ends, Progress, group_ends
from problem.arm import Arm, Joint
from problem.motion import Motion
from problem.registry import ProblemSettings
from problem.regressor import gram_matrix, observation_matrix

Injection = Callable[[], AbstractContextManager[object]]
Matrix = Callable[[Arm, Motion], Array]
Gram = Callable[[Arm, Motion, NDArray[np.intp]], Array]


@dataclass(frozen=True)
class Defect:
    """A defect, what it does in words, and the algorithms whose searches are run with it."""

    what: str
    algorithms: tuple[str, ...]
    inject: Injection


def _tell_without_selection(state: DEState, X: Array, fitness: Array) -> DEState:
    state.population, state.fitness, state.started = X.copy(), as_loss(fitness), True
    return state


def _fly_straight_on(swarm: Swarm, w: float, c1: float, c2: float, rng: np.random.Generator) -> None:
    """Like `fly`, but a particle keeps its first velocity until it meets a bound."""
    if swarm.velocity.any():
        swarm.position += swarm.velocity
    else:
        fly(swarm, w, c1, c2, rng)


def _matrix_without_velocities(arm: Arm, motion: Motion) -> Array:
    return observation_matrix(arm, _without_velocities(motion))


def _gram_without_velocities(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Array:
    return gram_matrix(arm, _without_velocities(motion), columns)


def _without_velocities(motion: Motion) -> Motion:
    """The motion without velocities, so that Coriolis and centrifugal terms vanish."""
    return Motion(motion.position, np.zeros_like(motion.velocity), motion.acceleration)


def matrix_about_own_z(arm: Arm, motion: Motion) -> Array:
    """Eq. 39 as printed: each row is the moment about z of the link's own frame, through that frame's origin."""
    matrix = observation_matrix(*_with_locked_joints(arm, motion))
    blocks = matrix.reshape(*motion.batch, motion.samples, len(arm), 2, len(arm), 2, 10)[..., 1, :, 1, :]
    return np.ascontiguousarray(blocks).reshape(*motion.batch, motion.samples * len(arm), 10 * len(arm))


def _with_locked_joints(arm: Arm, motion: Motion) -> tuple[Arm, Motion]:
    """Behind each joint one more that is locked and carries the link: z of the link's frame is its axis."""
    still = np.eye(4)
    locked = Joint("locked", "revolute", still, still)
    joints = tuple(part for joint in arm.joints for part in (joint, locked))
    padded = (_insert_zeros(array) for array in (motion.position, motion.velocity, motion.acceleration))
    return Arm(arm.name, joints, gravity=arm.gravity), Motion(*padded)


def _insert_zeros(array: Array) -> Array:
    return np.stack([array, np.zeros_like(array)], axis=-1).reshape(*array.shape[:-1], 2 * array.shape[-1])


def _gram_about_own_z(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Array:
    """The Gram matrix of all rows of the arm with locked joints, less that of the rows of its own joints."""
    doubled, behind = _with_locked_joints(arm, motion), 10 * (columns // 10 + 1)
    return gram_matrix(*doubled, columns + behind) - gram_matrix(arm, motion, columns)


def _column_signs(columns: NDArray[np.intp]) -> Array:
    """Signs of the columns, wrong for the last one, Iyz of the last link."""
    return np.where(columns == columns.max(), -1.0, 1.0)


def _matrix_with_wrong_sign(arm: Arm, motion: Motion) -> Array:
    return observation_matrix(arm, motion) * _column_signs(np.arange(10 * len(arm)))


def _gram_with_wrong_sign(arm: Arm, motion: Motion, columns: NDArray[np.intp]) -> Array:
    return gram_matrix(arm, motion, columns) * np.outer(_column_signs(columns), _column_signs(columns))


def _replace_regressor(matrix: Matrix, gram: Gram) -> Injection:
    @contextmanager
    def inject() -> Iterator[None]:
        with ExitStack() as stack:
            for place in ("problem.spectrum.observation_matrix", "problem.base_parameters.observation_matrix"):
                stack.enter_context(patch(place, matrix))
            stack.enter_context(patch("problem.spectrum.gram_matrix", gram))
            stack.enter_context(patch("bench.execute.build_problem", lru_cache(_build_problem)))
            yield

    return inject


def _build_problem(settings: ProblemSettings) -> object:
    return settings.build()


_TRIED_ALGORITHMS = ("spso", "de")  # a fault of the problem is in every search; two algorithms are enough to run

DEFECTS: Mapping[str, Defect] = MappingProxyType(
    {
        "de-without-selection": Defect(
            "DE takes every trial point, better or not",
            ("de",),
            lambda: patch.object(DE, "tell", staticmethod(_tell_without_selection)),
        ),
        "spso-frozen-velocity": Defect(
            "SPSO's particles keep their first velocity",
            ("spso",),
            lambda: patch("algorithms.spso.fly", _fly_straight_on),
        ),
        "no-coriolis-terms": Defect(
            "the observation matrix lacks the Coriolis and centrifugal terms",
            _TRIED_ALGORITHMS,
            _replace_regressor(_matrix_without_velocities, _gram_without_velocities),
        ),
        "wrong-axis": Defect(
            "the torque is projected on z of the link's own frame, not on the joint's axis",
            _TRIED_ALGORITHMS,
            _replace_regressor(matrix_about_own_z, _gram_about_own_z),
        ),
        "mupso-without-mutation": Defect(
            "MuPSO never mutates",
            ("mupso",),
            lambda: patch("algorithms.mupso._must_mutate", lambda state: False),
        ),
        "sign-of-a-column": Defect(
            "the last column of the observation matrix has the wrong sign",
            _TRIED_ALGORITHMS,
            _replace_regressor(_matrix_with_wrong_sign, _gram_with_wrong_sign),
        ),
    }
)


def run_ends_with_defect(name: str, entries: Sequence[Entry], workers: int, progress: Progress) -> Ends:
    """Ends, by cell, of the trials that the defect affects."""
    concerned = [entry for entry in entries if entry.trial.algorithm in DEFECTS[name].algorithms]
    shares = [concerned[worker::workers] for worker in range(workers)]
    with parallel_config(backend="loky", inner_max_num_threads=1):
        results = Parallel(n_jobs=workers)(
            delayed(run_with_defect)(name, [entry.trial for entry in share]) for share in shares
        )
    progress(len(concerned))
    outcomes = {
        entry.key: outcome
        for share, done in zip(shares, results, strict=True)
        for entry, outcome in zip(share, done, strict=True)
    }
    return group_ends((entry, outcomes[entry.key]) for entry in concerned)


def run_with_defect(name: str, trials: Sequence[Trial]) -> list[Outcome]:
    """Run trials, one after the other, under a defect."""
    with DEFECTS[name].inject():
        return [run_trial(trial) for trial in trials]
