"""Rigid links with usual friction, fitted to a reading: errors on blocks of time that are held out.

    tau_j = Y_j(q, qd, qdd) phi + v_j qd_j + c_j sign(qd_j) + I_j qdd_j + o_j + s_j q_j + p_j(q),    v, c, I >= 0

Friction and rotor are those of drives, which move with T' qd where tau = T tau_drives; where a second drive acts on a
joint (coupled axes), v, c and I of it stand there, too. p_j are the springs and the weight without load that the robot
file states, as it states them.
A joint has a spring s_j only where the reading says so. The links phi are drawn to those of the simulation by a normal
prior in the metric of pseudo-inertias (Lee and Park 2018): `near` where they may be as far off as simulations usually
are, `free` where the data decide. Links that are physically consistent are fitted with the entropic divergence to the
same bodies (Lee, Wensing and Park 2020), whose barrier keeps every pseudo-inertia positive definite.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from armlab.common.arrays import Array
from armlab.recordings.reading.reading import LINK_DATA, Reading, second_drives
from armlab.recordings.reading.signals import Channels
from armlab.recordings.reading.tuning import ReadingTuning
from problem.arm import Arm, Link
from problem.drive_torque import position_torque
from problem.motion import Motion
from problem.pseudo_inertia import (
    entropic_information,
    links_of,
    parameters_of,
    pseudo_inertia_basis,
    pseudo_inertias,
    regular_nominal,
)
from problem.regressor import coupled_links_torque, observation_matrix, rigid_body_torque

FOLDS = 2  # even and odd blocks are held out in turn
JOINT_COLUMNS = 8  # of a joint: viscous and Coulomb friction, rotor inertia, offset, spring, those of a second drive
SPRING = 4  # which of them is the spring
OF_ANY_SIGN = (3, SPRING)  # the others are not negative


@dataclass(frozen=True, eq=False)
class ReadingColumns:
    """Columns of a motion: rigid (rows, joints, 10 * joints), own (rows, joints, 8), and their products on each fold.

    grams: (folds, joints, size, size) of the rigid columns followed by the joint's own ones. stated: (rows, joints),
    torque of the springs and the compensated weight that the robot file states, coupled: of the links of coupled
    joints, N m (N).
    """

    motion: Motion
    rigid: Array
    own: Array
    grams: Array
    stated: Array
    coupled: Array


def make_columns(arm: Arm, motion: Motion, drives: Array, fold: NDArray[np.intp]) -> ReadingColumns:
    """The columns of a motion (rows, joints).

    drives: (rows, joints, 2, 3), velocity, its sign and acceleration of each joint's own drive and of a second one,
    zeros without it. fold: (rows,) of each row.
    """
    joints = len(arm)
    rigid = observation_matrix(arm, motion).reshape(motion.samples, joints, 10 * joints)
    offset_and_spring = np.stack([np.ones_like(motion.position), motion.position], axis=2)
    own = np.concatenate([drives[:, :, 0], offset_and_spring, drives[:, :, 1]], axis=2)
    grams = np.zeros((FOLDS, joints, 10 * joints + JOINT_COLUMNS, 10 * joints + JOINT_COLUMNS))
    for number in range(FOLDS):
        rows = fold == number
        for joint in range(joints):
            used = np.arange(10 * joint, 10 * joints + JOINT_COLUMNS)  # links before a joint do not load it
            part = np.concatenate([rigid[rows, joint, 10 * joint :], own[rows, joint]], axis=1)
            grams[number, joint][np.ix_(used, used)] = part.T @ part
    return ReadingColumns(motion, rigid, own, grams, position_torque(arm, motion), coupled_links_torque(arm, motion))


@dataclass(frozen=True, eq=False)
class BodyPrior:
    """Bodies that links are drawn to: centre (10 * joints,), and the information about it at width one."""

    centre: Array
    information: Array
    pseudos: Array


@lru_cache(maxsize=64)
def _typical_prior(arm: Arm, mass: float, reach: float) -> BodyPrior:
    body = mass * np.array([0.1, 0.1, 0.1]) * reach**2
    links = tuple(Link(mass, (0.0, 0.0, 0.0), (*(2 * body).tolist(), 0.0, 0.0, 0.0)) for _ in arm.joints)
    return _prior(replace(arm, links=links))


def _prior(arm: Arm, load_share: float = 0.0) -> BodyPrior:
    """load_share: of a link of the arm, that the last one may carry: its own data do not say how large a load is."""
    pseudos = regular_nominal(arm)
    link = pseudos.mean(axis=0)
    pseudos[-1] += load_share * np.diag([*(np.trace(link[:3, :3]) / 3,) * 3, link[3, 3]])
    return BodyPrior(arm.parameters, entropic_information(pseudos), pseudos)


@dataclass(frozen=True, eq=False)
class ReadingScore:
    """Held-out errors of a reading. errors: (joints,), rms over the scatter of the joint's torque.

    values: (folds, 10 * joints) of the links, own: (folds, joints, 8) of the joints. distance: of the links from those
    of the simulation, minus the logarithm of their prior over the number of independent rows.
    """

    errors: Array
    values: Array
    own: Array
    distance: float


@dataclass(frozen=True, eq=False)
class _FreeColumns:
    """Which columns a fit has: all of the links, then own ones. present: (joints, 8); the others stay zero.

    kept: places among all columns; signed: places among the kept ones that are not negative, rest: of the others.
    """

    present: NDArray[np.bool_]
    kept: NDArray[np.intp]
    signed: NDArray[np.intp]
    rest: NDArray[np.intp]


@lru_cache(maxsize=64)
def _layout(joints: int, springs: tuple[int, ...], second: tuple[bool, ...]) -> _FreeColumns:
    """All joints have friction, a rotor and an offset; some have a spring or a second drive."""
    present = np.zeros((joints, JOINT_COLUMNS), dtype=bool)
    present[:, :SPRING] = True
    present[list(springs), SPRING] = True
    present[list(second), SPRING + 1 :] = True
    links, own = 10 * joints, np.flatnonzero(present)
    signed = links + np.flatnonzero(~np.isin(own % JOINT_COLUMNS, OF_ANY_SIGN))
    rest = np.setdiff1d(np.arange(links + len(own)), signed)
    return _FreeColumns(present, np.concatenate([np.arange(links), links + own]), signed, rest)


@dataclass(frozen=True, eq=False)
class Fitter:
    """Fits readings of the channels of one recording."""

    channels: Channels
    tuning: ReadingTuning
    _columns: dict[tuple[object, ...], ReadingColumns] = field(default_factory=dict)
    _priors: dict[tuple[bytes, float], BodyPrior] = field(default_factory=dict)

    @property
    def fold(self) -> NDArray[np.intp]:
        """(rows,), 0 for even blocks and 1 for odd ones."""
        return np.asarray(self.channels.block % FOLDS, dtype=np.intp)

    def columns(self, reading: Reading) -> ReadingColumns:
        """Columns of a reading's motion, kept for readings that differ in torque alone."""
        key = (
            reading.position.tobytes(),
            reading.offset.tobytes(),
            reading.position_order,
            reading.clock,
            id(reading.arm.joints),
            reading.arm.gravity,
            reading.friction_ways,
        )
        if key not in self._columns:
            if len(self._columns) > 24:
                self._columns.pop(next(iter(self._columns)))
            motion = self.channels.read_motion(reading)
            drive_signals = self.channels.drive_signals(reading, motion, self.tuning.sign_width)
            self._columns[key] = make_columns(reading.arm, motion, drive_signals, self.fold)
        return self._columns[key]

    def prior(self, reading: Reading, torque: Array, may_carry: bool = False) -> BodyPrior:
        """About the links of the simulation, or about bodies of the size that the torque suggests.

        may_carry: whether the last link may carry a load as large as a link, however small it is itself.
        """
        arm = reading.arm
        if reading.inertial is not None:
            load = may_carry / self.tuning.free_width
            key = reading.inertial.tobytes(), load
            if key not in self._priors:
                self._priors[key] = _prior(replace(arm, links=links_of(reading.inertial)), load)
            return self._priors[key]
        reach = sum(float(np.linalg.norm(j.before[:3, 3]) + np.linalg.norm(j.after[:3, 3])) for j in arm.joints) or 1.0
        turning = arm.joints[0].kind == "revolute"
        mass = float(np.std(torque, axis=0).max()) / (9.81 * (reach if turning else 1.0))
        return _typical_prior(arm, 2.0 ** round(np.log2(max(mass, 1e-6))), round(reach, 3))

    def scores(
        self, reading: Reading, widths: Sequence[float], physical: bool = False, may_carry: bool = False
    ) -> list[ReadingScore]:
        """Held-out errors with links of each width about the simulation.

        The last link is free, but where its own data are said to be wrong. physical: links that bodies can have.
        may_carry: see `prior`.
        """
        columns, torque, weight = self._target(reading)
        prior = self.prior(reading, torque, may_carry)
        second = tuple(place is not None for place in second_drives(reading))
        layout = _layout(reading.joints, reading.springs, second)
        products = [_products(columns, torque, self.fold == number) for number in range(FOLDS)]
        power = [np.sum(torque[self.fold == number] ** 2, axis=0) for number in range(FOLDS)]
        normal = [self._normal_equations(columns, products, weight, 1 - number, layout) for number in range(FOLDS)]
        out = []
        for width in widths:
            each = np.full(reading.joints, width)
            if not says_last_link(reading):
                each[-1] = max(width, self.tuning.free_width)
            squares, distance, fitted = np.zeros(reading.joints), 0.0, []
            for number, (gram, product) in enumerate(normal):
                task = _Task(gram, product, prior, each**-2.0, layout)
                links, own = task.physical() if physical else task.gaussian()
                squares += _squares(columns.grams[number], products[number], power[number], links, own)
                distance += task.distance(links, physical) / (
                    self.channels.blocks * self.tuning.independent_rows * FOLDS
                )
                fitted.append((links, own))
            values, owns = (np.stack(parts) for parts in zip(*fitted, strict=True))
            errors = np.sqrt(np.maximum(squares, 0.0) / len(torque)) * weight
            out.append(ReadingScore(errors, values, owns, distance))
        return out

    def _target(self, reading: Reading) -> tuple[ReadingColumns, Array, Array]:
        """Columns, the torque (rows, joints) that they have to explain, and one over its scatter (joints,).

        Gravity that is added back makes no error smaller beside it: the scatter is that of what was recorded.
        """
        columns = self.columns(reading)
        recorded = self.channels.read_torque(reading) - columns.stated - columns.coupled
        torque, scatter = recorded + self.channels.added_gravity(reading), np.std(recorded, axis=0)
        return columns, torque, np.where(scatter > 0, 1 / np.where(scatter > 0, scatter, 1.0), 0.0)

    def shares(self, reading: Reading, score: ReadingScore) -> Array:
        """Mean squares of the held-out errors over the scatter of the joint's torque, (blocks, joints)."""
        columns, torque, weight = self._target(reading)
        out = np.zeros((self.channels.blocks, reading.joints))
        for number in range(FOLDS):
            rows = self.fold == number
            found = columns.rigid[rows] @ score.values[number]
            found = found + np.einsum("rjk,jk->rj", columns.own[rows], score.own[number])
            np.add.at(out, self.channels.block[rows], ((torque[rows] - found) * weight) ** 2)
        return out / np.bincount(self.channels.block, minlength=self.channels.blocks)[:, None]

    def _normal_equations(
        self, columns: ReadingColumns, products: Sequence[Array], weight: Array, fold: int, layout: _FreeColumns
    ) -> tuple[Array, Array]:
        """Gram matrix and product with the torque, in nats, of the rows of a fold."""
        joints, rows = len(weight), self.fold == fold
        blocks = len(np.unique(self.channels.block[rows]))
        scale = blocks * self.tuning.independent_rows / (max(rows.sum(), 1) * self.tuning.model_error**2) * weight**2
        links, size = 10 * joints, (10 + JOINT_COLUMNS) * joints
        gram, product = np.zeros((size, size)), np.zeros(size)
        grams = columns.grams[fold]
        gram[:links, :links] = np.tensordot(scale, grams[:, :links, :links], axes=1)
        product[:links] = scale @ products[fold][:, :links]
        product[links:] = (scale[:, None] * products[fold][:, links:]).ravel()
        for joint in range(joints):
            places = slice(links + JOINT_COLUMNS * joint, links + JOINT_COLUMNS * (joint + 1))
            gram[:links, places] = scale[joint] * grams[joint, :links, links:]
            gram[places, :links] = gram[:links, places].T
            gram[places, places] = scale[joint] * grams[joint, links:, links:]
        return gram[np.ix_(layout.kept, layout.kept)], product[layout.kept]

    def implausible(self, reading: Reading) -> frozenset[int]:
        """Joints (from 0) that would be faster than joints of arms are, or hardly turn."""
        motion, tuning = self.columns(reading).motion, self.tuning
        fast = np.abs(motion.velocity).max(axis=0) > tuning.fastest_speed
        turning = np.array([joint.kind == "revolute" for joint in reading.arm.joints])
        hardly = turning & (np.ptp(motion.position, axis=0) < tuning.travels[0])
        return frozenset(np.flatnonzero(fast | hardly).tolist())

    def torque_gains(self, reading: Reading) -> Array:
        """Factor between the torque of each joint and that of the links as given, friction apart, (joints,)."""
        columns = self.columns(reading)
        torque = self.channels.read_torque(reading) + self.channels.added_gravity(reading) - columns.stated
        given = rigid_body_torque(reading.arm, columns.motion, reading.inertial)
        out = np.zeros(reading.joints)
        for joint in range(reading.joints):
            own = columns.own[:, joint, :SPRING]
            model, measured = (
                each[:, joint] - own @ np.linalg.lstsq(own, each[:, joint])[0] for each in (given, torque)
            )
            power = float(model @ model)
            out[joint] = float(model @ measured) / power if power > 0 else 0.0
        return out


def says_last_link(reading: Reading) -> bool:
    """Whether a mistake is about the data of the last link: with other data a load is no reason for it."""
    return any(each.effect == LINK_DATA and each.joint == reading.joints for each in reading.mistakes)


def _products(columns: ReadingColumns, torque: Array, rows: NDArray[np.bool_]) -> Array:
    """Products with the torque of each joint, (joints, 10 * joints + 5), in the order of the Gram matrices."""
    rigid = np.einsum("rjp,rj->jp", columns.rigid[rows], torque[rows])
    own = np.einsum("rjk,rj->jk", columns.own[rows], torque[rows])
    return np.concatenate([rigid, own], axis=1)


def _squares(grams: Array, products: Array, power: Array, links: Array, own: Array) -> Array:
    """Sums of squared errors of each joint, (joints,): power - 2 product' x + x' gram x, x = links and own columns."""
    both = np.concatenate([np.broadcast_to(links, (len(own), len(links))), own], axis=1)
    return np.asarray(power + np.sum(both * (np.einsum("jpq,jq->jp", grams, both) - 2 * products), axis=1))


@dataclass(frozen=True, eq=False)
class _Task:
    """One fit: minimise half of x' gram x - product' x plus the prior of the links, x = links and own columns."""

    gram: Array
    product: Array
    prior: BodyPrior
    precision: Array  # (joints,) of the prior of each link
    layout: _FreeColumns

    @property
    def joints(self) -> int:
        """Number of joints."""
        return len(self.precision)

    def _split(self, x: Array) -> tuple[Array, Array]:
        """Links (10 * joints,) and all own columns (joints, 8)."""
        links = 10 * self.joints
        own = np.zeros(self.layout.present.shape)
        own[self.layout.present] = x[links:]
        return x[:links], own

    @property
    def _information(self) -> Array:
        return self.prior.information * np.repeat(self.precision, 10)[:, None]

    def distance(self, values: Array, physical: bool) -> float:
        """Minus the logarithm of the prior at links (10 * joints,)."""
        if physical:
            ratios = np.linalg.solve(self.prior.pseudos, pseudo_inertias(values))
            traces = np.trace(ratios, axis1=1, axis2=2)
            return float(self.precision @ (traces - np.linalg.slogdet(ratios)[1] - 4))
        off = values - self.prior.centre
        return 0.5 * float(off @ self._information @ off)

    def gaussian(self) -> tuple[Array, Array]:
        """Links under the normal prior; friction and rotors that would be negative are left out."""
        links = 10 * self.joints
        gram, product = self.gram.copy(), self.product.copy()
        information = self._information
        gram[:links, :links] += information
        product[:links] += information @ self.prior.centre
        lengths = np.sqrt(np.maximum(np.diag(gram), 1e-300))
        unit, right = gram / np.outer(lengths, lengths) + 1e-10 * np.eye(len(gram)), product / lengths
        signed, rest = self.layout.signed, self.layout.rest
        # of the others given those with a sign: x_rest = start - along @ x_signed
        solved = np.linalg.solve(unit[np.ix_(rest, rest)], np.column_stack([right[rest], unit[np.ix_(rest, signed)]]))
        start, along = solved[:, 0], solved[:, 1:]
        inner = unit[np.ix_(signed, signed)] - unit[np.ix_(signed, rest)] @ along
        wanted = right[signed] - unit[np.ix_(signed, rest)] @ start
        x = np.zeros(len(gram))
        x[signed] = _not_negative(inner, wanted)
        x[rest] = start - along @ x[signed]
        return self._split(x / lengths)

    def physical(self) -> tuple[Array, Array]:
        """Links that bodies can have; friction and rotors stay positive by a barrier.

        Damped Newton steps, while the barriers fall to the wanted precision: an interior-point method.
        """
        links, signed = 10 * self.joints, self.layout.signed
        size = np.sqrt(np.maximum(np.diag(self.gram), SMALLEST))
        x = np.zeros(len(self.gram))
        x[:links] = parameters_of(self.prior.pseudos)
        x[signed] = 1 / np.maximum(size, 1e-6 * size.max())[signed]
        factor = max(FIRST_BARRIER / float(self.precision.min()), 1.0)
        while True:
            x = self._newton(x, factor * self.precision, factor * FRICTION_BARRIER)
            if factor <= 1:
                return self._split(x)
            factor = max(factor * BARRIER_FALL, 1.0)

    def _newton(self, x: Array, precision: Array, barrier: float) -> Array:
        """Newton steps for one weight of the barriers."""
        links, signed = 10 * self.joints, self.layout.signed
        pull = np.linalg.inv(self.prior.pseudos)
        slope = np.einsum("jab,pba->jp", pull, pseudo_inertia_basis())
        each = np.repeat(precision, 10)
        value = self._objective(x, slope, precision, barrier)
        for _ in range(MAX_NEWTON_STEPS):
            pseudos = pseudo_inertias(x[:links])
            inverse = np.einsum("jab,pba->jp", np.linalg.inv(pseudos), pseudo_inertia_basis())
            gradient, hessian = self.gram @ x - self.product, self.gram.copy()
            gradient[:links] += each * (slope - inverse).ravel()
            hessian[:links, :links] += each[:, None] * entropic_information(pseudos)
            gradient[signed] -= barrier / x[signed]
            hessian[signed, signed] += barrier / x[signed] ** 2
            lengths = np.sqrt(np.diag(hessian) + SMALLEST)
            unit = hessian / np.outer(lengths, lengths) + 1e-12 * np.eye(len(x))
            step = -np.linalg.solve(unit, gradient / lengths) / lengths
            decrement = -float(gradient @ step)
            if decrement < NEWTON_TOLERANCE * float(each.sum()):
                break
            length, trial = 1.0, np.inf
            while length > 1e-6:
                trial = self._objective(x + length * step, slope, precision, barrier)
                if trial < value - 1e-4 * length * decrement:
                    break
                length /= 2
            else:
                break
            x, value = x + length * step, trial
        return x

    def _objective(self, x: Array, slope: Array, precision: Array, barrier: float) -> float:
        links, signed = 10 * self.joints, self.layout.signed
        if np.any(x[signed] <= 0):
            return np.inf
        try:
            roots = np.linalg.cholesky(pseudo_inertias(x[:links]))
        except np.linalg.LinAlgError:
            return np.inf
        logarithms = 2 * np.sum(np.log(np.diagonal(roots, axis1=1, axis2=2)), axis=1)
        fit = 0.5 * float(x @ self.gram @ x) - float(self.product @ x)
        divergence = np.sum(slope * x[:links].reshape(self.joints, 10), axis=1) - logarithms
        return fit + float(precision @ divergence) - barrier * float(np.sum(np.log(x[signed])))


def _not_negative(gram: Array, product: Array) -> Array:
    """The least of half of x' gram x - product' x; what would be negative is left out, step by step."""
    x, free = np.zeros(len(gram)), np.ones(len(gram), dtype=bool)
    while True:
        x[free] = np.linalg.solve(gram[np.ix_(free, free)], product[free])
        negative = free & (x < 0)
        if not negative.any():
            return x
        free &= ~negative
        x[negative] = 0.0


SMALLEST = 1e-100
MAX_NEWTON_STEPS = 40  # for each weight of the barriers
NEWTON_TOLERANCE = 1e-2  # of the weight of the barriers
BARRIER_FALL = 0.1
FIRST_BARRIER = 100.0
FRICTION_BARRIER = 0.1  # nats: a friction that the data do not want goes to almost zero
