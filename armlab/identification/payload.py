"""A load that some runs carry: its inertial parameters, or, where they are known, the torque gains.

Links and friction are the same in all runs; only what differs between them determines the load (Khalil, Gautier
and Lemoine 2007). A known load shows the gain of each joint's torque reading (Gautier and Briot 2014).

The load is a body that can exist: its pseudo-inertia is positive semidefinite. `payload_lines` and `gains_lines` go
from recordings with and without the load to the lines of `armlab payload` and `armlab recording gains`.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from armlab.common.arrays import Array
from armlab.common.documents import Document, ResultLines
from armlab.common.errors import DataError, InputError
from armlab.effects.drive import TorqueOffset
from armlab.identification.components import usual_components
from armlab.identification.covariance import uncertainty
from armlab.identification.estimators.conic import ConicProgram
from armlab.identification.estimators.least_squares import WeightedLeastSquares, joint_weights
from armlab.identification.estimators.physical import TYPICAL_BODY
from armlab.identification.priors import point_mass
from armlab.identification.regression import Regression, regression, require_rows, signals_of, suggested_cutoff
from armlab.identification.selection import counterbalance_groups
from armlab.identification.structure import Structure
from armlab.recordings.dead_joints import leave_out_together
from armlab.recordings.differentiate import Signals
from armlab.recordings.identifiable import require_identifiable, require_possible
from armlab.recordings.load import load_recording
from problem.arm import PARAMETER_NAMES, PARAMETER_UNITS, Arm, Link
from problem.pseudo_inertia import link_from_centre_of_mass, link_of, pseudo_inertias
from problem.regressor import observation_matrix

EIGENVALUE_TOLERANCE = 1e-12  # of a body: a point mass has eigenvalues of zero


def nearest_physical_load(data: Regression, free: Array, basis: Array) -> Array:
    """The load's numbers (sought,), which are the last columns of weighted data; the others stay free.

    free: the numbers without the condition, returned where they are physical. basis: (10, sought), parameters of
    each number. Raises InputError without Clarabel, RuntimeError where the solver finds no solution.
    """
    units = pseudo_inertias(basis.T.ravel())
    shapes = units / np.outer(TYPICAL_BODY, TYPICAL_BODY)  # near the unit matrix for a load of a usual size
    eigenvalues = np.linalg.eigvalsh(np.tensordot(free, shapes, 1))
    if eigenvalues[0] >= -EIGENVALUE_TOLERANCE * np.abs(eigenvalues).max():
        return free
    triangle = np.linalg.qr(np.column_stack([data.matrix, data.torque]))[1]
    own = slice(data.matrix.shape[1] - len(free), data.matrix.shape[1])
    block, target = triangle[own, own], triangle[own, -1]
    lengths = np.linalg.norm(block, axis=0)
    size = max(float(np.linalg.norm(target)), 1e-300)
    program = ConicProgram(len(free))
    program.require_semidefinite(shapes / lengths[:, None, None], np.zeros((4, 4)))
    found = program.solve(block / lengths, target / size)
    if isinstance(found, str):
        raise RuntimeError(f"no load that can exist was found: the solver says '{found}'")
    return np.asarray(size * found / lengths)


MIN_SINGULAR_VALUE_SHARE = 1e-8  # of the largest singular value of the load's columns at unit length


@dataclass(frozen=True)
class Place:
    """Where a load sits: on a link, counted from 1 (None: the last); as a point of its frame, m, if that is known.

    Of a load at a known point only the mass is sought.
    """

    link: int | None = None
    centre: tuple[float, float, float] | None = None

    @property
    def basis(self) -> Array:
        """Ten parameters for each number that is sought, (10, sought)."""
        return np.eye(10) if self.centre is None else point_mass(1, self.centre)[:, None]

    def columns(self, structure: Structure, signals: Signals) -> Array:
        """Filtered columns of the load, (kept * joints, sought)."""
        last = 10 * (self.link or len(structure.arm))
        own = observation_matrix(structure.arm, signals.motion)[:, last - 10 : last]
        return signals.columns(own @ self.basis)


@dataclass(frozen=True, eq=False)
class IdentifiedLoad:
    """A load: parameters (10,) about its link's frame, of a body that can exist; covariance (10, 10).

    factor: from a standard error to half of a 95 % interval. The covariance is that of a fit without the condition
    that the body can exist: on the safe side where the condition matters.
    """

    parameters: Array
    covariance: Array
    factor: float

    @property
    def is_there(self) -> bool:
        """Whether the 95 % interval of the mass is above zero."""
        return bool(self.parameters[0] > self.half_widths[0])

    @property
    def link(self) -> Link:
        """The load as a body."""
        return link_of(self.parameters)

    @property
    def half_widths(self) -> Array:
        """Half widths of the 95 % intervals of the parameters, (10,)."""
        return np.asarray(self.factor * np.sqrt(np.maximum(np.diag(self.covariance), 0)))

    @property
    def centre(self) -> Array:
        """Centre of mass, (3,), m in its link's frame."""
        return np.asarray(self.parameters[1:4] / self.parameters[0])

    @property
    def centre_half_widths(self) -> Array:
        """Half widths of the 95 % intervals of the centre of mass, (3,), m."""
        slopes = np.column_stack([-self.centre, np.eye(3)]) / self.parameters[0]
        spread = np.diag(slopes @ self.covariance[:4, :4] @ slopes.T)
        return np.asarray(self.factor * np.sqrt(np.maximum(spread, 0)))


@dataclass(frozen=True, eq=False)
class TorqueGains:
    """How much each joint's torque reading is too large (1.09: 9 %), with half widths of 95 % intervals; (joints,)."""

    gains: Array
    half_widths: Array


def identify_payload(
    structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals], place: Place | None = None
) -> IdentifiedLoad:
    """The load that some runs carry and others do not, as the body that can exist and explains them best.

    Raises ValueError where runs of either kind are missing, or where these motions do not determine the parameters of
    the load.
    """
    place = place or Place()
    if not without or not loaded:
        raise DataError("runs with the load and runs without it are needed")
    columns = np.vstack([place.columns(structure, each) for each in loaded])
    data = _append_columns(regression(structure, [*without, *loaded]), columns)
    require_rows(data)
    _check_load_columns(data.matrix, columns.shape[1])
    estimate = WeightedLeastSquares()(data)
    spread = uncertainty(data, estimate)
    weighted = data.weighted(joint_weights(data, estimate.values))
    sought = slice(len(estimate.values) - columns.shape[1], None)
    values = nearest_physical_load(weighted, estimate.values[sought], place.basis)
    return IdentifiedLoad(
        place.basis @ values, place.basis @ spread.covariance[sought, sought] @ place.basis.T, spread.factor
    )


def torque_gains(
    structure: Structure, without: Sequence[Signals], loaded: Sequence[Signals], payload: Link, link: int | None = None
) -> TorqueGains:
    """Gains from a load that is known, such as a weighed disc; ValueError as for `identify_payload`."""
    joints = len(structure.arm)
    if not without or not loaded:
        raise DataError("runs with the load and runs without it are needed")
    blocks = []
    for each in loaded:
        torque = (Place(link).columns(structure, each) @ payload.parameters).reshape(-1, joints)
        blocks.append((torque[:, :, None] * np.eye(joints)).reshape(-1, joints))
    columns = np.vstack(blocks)
    moved = np.linalg.norm(columns, axis=0) > 0  # a joint that the load never loads does not determine its gain
    data = _append_columns(regression(structure, [*without, *loaded]), columns[:, moved])
    require_rows(data)
    _check_load_columns(data.matrix, int(moved.sum()))
    estimate = WeightedLeastSquares()(data)
    spread = uncertainty(data, estimate)
    gains, half = np.full((2, joints), np.nan)
    own = slice(-int(moved.sum()), None)
    gains[moved], half[moved] = estimate.values[own], (spread.factor * spread.standard_errors)[own]
    return TorqueGains(gains, half)


def _append_columns(data: Regression, columns: Array) -> Regression:
    padded = np.vstack([np.zeros((len(data.torque) - len(columns), columns.shape[1])), columns])
    return replace(data, matrix=np.hstack([data.matrix, padded]))


def _check_load_columns(matrix: Array, count: int) -> None:
    """Raises ValueError where the last columns depend on each other or on the others."""
    lengths = np.linalg.norm(matrix, axis=0)
    values = np.linalg.svd(
        np.linalg.qr(matrix / np.where(lengths > 0, lengths, 1))[1][-count:, -count:], compute_uv=False
    )
    if values[-1] < MIN_SINGULAR_VALUE_SHARE:
        raise DataError("these motions do not determine the parameters of the load: move more joints, and faster")


CENTRE_NAMES = ("centre x", "centre y", "centre z")
LOAD_POSITION_FACTOR = 2.0  # columns then lose nothing to the torque, and loads move arms slowly enough for it


@dataclass(frozen=True)
class LoadNumber:
    """A number of a load with half of its 95 % interval."""

    name: str
    value: float
    half_width: float
    unit: str


@dataclass(frozen=True)
class PayloadSetting:
    """What a person says of the load and the arm: see the options of the commands.

    counterbalanced: the joint with a counterbalance, which a spring stands for; cutoff_hz: from the data if None.
    """

    place: Place
    counterbalanced: int | None = None
    cutoff_hz: float | None = None

    def check(self, arm: Arm) -> None:
        """Raises InputError for a link or a joint that the arm does not have."""
        for what, joint in (("--link", self.place.link), ("--counterbalance", self.counterbalanced)):
            if joint is not None and joint > len(arm):
                raise InputError(f"{what} {joint} should be one from 1 to {len(arm)}")


@dataclass(frozen=True, eq=False)
class _PayloadTask:
    structure: Structure
    loaded: Sequence[Signals]
    without: Sequence[Signals]

    @staticmethod
    def of(loaded: Path, without: Path, setting: PayloadSetting) -> "_PayloadTask":
        """Reads the recordings; the runs that identify take part, by one cut-off."""
        carrying, bare = load_recording(loaded), load_recording(without)
        if len(bare.arm) != len(carrying.arm):
            raise InputError(f"{without} has {len(bare.arm)} joints, {loaded} has {len(carrying.arm)}")
        setting.check(carrying.arm)
        carrying, bare = leave_out_together(carrying, bare)
        for each in (carrying, bare):
            require_identifiable(each)
            require_possible(each)
        runs = carrying.runs_to_identify(), bare.runs_to_identify()
        cutoff = setting.cutoff_hz or max(map(suggested_cutoff, (*runs[0], *runs[1])))
        signals = ([signals_of(run, cutoff, LOAD_POSITION_FACTOR) for run in each] for each in runs)
        return _PayloadTask(_payload_structure(carrying.arm, setting), *signals)


def _payload_structure(arm: Arm, setting: PayloadSetting) -> Structure:
    """The usual components, and the spring of a counterbalance."""
    spring = counterbalance_groups(arm, setting.counterbalanced)["spring"] if setting.counterbalanced else ()
    sprung = [part.joint for part in spring]  # the spring's rest angle takes the offset in
    taken = tuple(
        part for part in usual_components(arm) if not isinstance(part, TorqueOffset) or part.joint not in sprung
    )
    return Structure(arm, (*taken, *spring)).separable()[0]


def payload_lines(loaded: Path, without: Path, setting: PayloadSetting) -> ResultLines:
    """The load of a recording, with intervals; InputError, in one line, where the recordings do not determine it."""
    task = _PayloadTask.of(loaded, without, setting)
    try:
        payload = identify_payload(task.structure, task.without, task.loaded, setting.place)
    except DataError as error:
        raise InputError(f"{loaded}: {error}") from None
    mass_alone = setting.place.centre is not None
    numbers = list(_payload_numbers(payload, mass_alone))
    yield from (number_line(each) for each in numbers)
    if not (mass_alone or payload.is_there):
        yield "its centre is not determined: the interval of its mass reaches zero"
    mass = numbers[0]
    if mass.value < 0:
        yield "warning: no load weighs less than nothing: are the recordings exchanged, or is torque not of this arm?"
    return load_document(setting.place.link or len(task.structure.arm), numbers)


def _payload_numbers(payload: IdentifiedLoad, mass_alone: bool) -> Iterator[LoadNumber]:
    """Each number of a load."""
    rows = list(zip(PARAMETER_NAMES, payload.parameters, payload.half_widths, PARAMETER_UNITS, strict=True))
    if payload.is_there:
        rows += zip(CENTRE_NAMES, payload.centre, payload.centre_half_widths, ["m"] * 3, strict=True)
    yield from (LoadNumber(*row) for row in rows[: 1 if mass_alone else None])


def load_document(link: int, numbers: Sequence[LoadNumber]) -> Document:
    """A load as a document: its link (from 1) and its numbers."""
    return {
        "link": link,
        "parameters": {each.name: _interval(each.value, each.half_width, each.unit) for each in numbers},
    }


def number_line(number: LoadNumber) -> str:
    """A number with its interval in a line."""
    return _interval_line(number.name, number.value, number.half_width, number.unit)


def _interval(value: float, half: float, unit: str) -> Document:
    """A number as a verdict writes it."""
    return {"value": value, "ci95": [value - half, value + half], "unit": unit}


def _interval_line(name: str, value: float, half: float, unit: str) -> str:
    """A number to two digits of half its interval."""
    decimals = max(1 - math.floor(math.log10(half)), 0) if half > 0 else 6
    return f"{name} = {value:.{decimals}f} [{value - half:.{decimals}f}, {value + half:.{decimals}f}] {unit}"


def gains_lines(loaded: Path, without: Path, mass: float, setting: PayloadSetting) -> ResultLines:
    """The gain of each joint's torque reading from a load of known mass at a known point."""
    task = _PayloadTask.of(loaded, without, setting)
    load = link_from_centre_of_mass(mass, np.array(setting.place.centre or (0.0, 0.0, 0.0)), np.zeros((3, 3)))
    try:
        gains = torque_gains(task.structure, task.without, task.loaded, load, setting.place.link)
    except DataError as error:
        raise InputError(f"{loaded}: {error}") from None
    yield from gains_table(gains)
    return gains_document(gains)


def gains_document(gains: TorqueGains) -> Document:
    """The gain of each joint as a document."""
    pairs = enumerate(zip(gains.gains, gains.half_widths, strict=True), 1)
    return {"gains": [{"joint": joint, **_interval(gain, half, "1")} for joint, (gain, half) in pairs]}


def gains_table(gains: TorqueGains) -> Iterator[str]:
    """The gain of each joint in a line."""
    for joint, (gain, half) in enumerate(zip(gains.gains, gains.half_widths, strict=True), 1):
        unknown = "the load does not load it enough" if np.isnan(gain) else ""
        yield f"joint {joint}: {unknown}" if unknown else _interval_line(f"joint {joint}: gain", gain, half, "")
