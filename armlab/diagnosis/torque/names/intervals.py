"""Named parameters with intervals: robust covariance, nonlinear parameters included, by the delta method."""

from dataclasses import dataclass, replace

import numpy as np

from armlab.common.arrays import Array
from armlab.common.probabilities import student_quantile
from armlab.diagnosis.torque.columns.blocks import BlockCovariance, block_covariance, whitened_rows
from armlab.diagnosis.torque.search.fitted_model import FittedModel
from armlab.diagnosis.torque.search.refine import prior_precision

CONFIDENCE = 0.95  # of the intervals that a verdict calls ci95


@dataclass(frozen=True, eq=False)
class ShapedFit:
    """The fit of a round with the derivatives by all shapes: covariance of links, effects, and shapes.

    places: where a group's shapes stand, by group. lengths: by which the shapes' columns are scaled.
    """

    model: FittedModel
    spread: BlockCovariance
    places: dict[int, slice]
    lengths: Array

    @property
    def factor(self) -> float:
        """From a standard error to half an interval."""
        factor = self.model.design.settings.tuning.intervals.factor
        return factor * student_quantile((1 + CONFIDENCE) / 2, self.spread.degrees)

    def covariance(self, group: int) -> Array:
        """Of a group's coefficients and shapes, unscaled, (coefficients + shapes,) squared."""
        chosen = _numbers_of(self.model, group, self.places.get(group))
        lengths = _units(self.model, group, self.lengths, self.places.get(group))
        return np.asarray(self.spread.covariance[np.ix_(chosen, chosen)] / np.outer(lengths, lengths))

    def base(self) -> tuple[Array, Array]:
        """Deviation of the base parameters and its covariance."""
        found = self.model
        factor, rank = found.fit.links, found.fit.links.shape[1]
        lengths = found.moments.lengths[: len(factor)]
        block = factor @ self.spread.covariance[:rank, :rank] @ factor.T
        return found.coefficients(found.fit)[: len(factor)], np.asarray(block / np.outer(lengths, lengths))


def _places(place: slice | None) -> range:
    return range(0) if place is None else range(place.start, place.stop)


def extend_with_shapes(model: FittedModel) -> ShapedFit:
    """Adds the torque's derivatives by the shapes to the columns of the fit."""
    design, fit = model.design, model.fit
    extra = {joint: np.empty((design.observed.rows, 0)) for joint in range(design.observed.joints)}
    places, start, bounds = {}, len(fit.inverse), list[tuple[float, float]]()
    for group in fit.state.groups:
        candidate = model.candidate(group)
        count = len(candidate.shape)
        if not count:
            continue
        values = model.solver.values(fit, group)
        slopes = [design.slope(group, which) @ values for which in range(count)]
        for joint in extra:
            own = np.zeros((design.observed.rows, count))
            if joint in candidate.rows:
                own = np.column_stack([slope[:, candidate.rows.index(joint)] for slope in slopes])
            extra[joint] = np.hstack([extra[joint], own])
        places[group] = slice(start, start + count)
        bounds += candidate.bounds
        start += count
    settings, lengths = design.settings, model.moments.lengths
    rows = whitened_rows(model.columns, extra, fit, lengths, model.noise, design.observed)
    own = np.sum([np.sum(design[:, len(fit.inverse) :] ** 2, axis=0) for design in rows.designs], axis=0)
    anywhere = np.array([12 / (high - low) ** 2 for low, high in bounds])  # of a number anywhere in its bounds
    shapes = np.sqrt(own + anywhere)
    scale = np.append(np.ones(len(fit.inverse)), shapes)
    rows = replace(rows, designs=tuple(design / scale for design in rows.designs))
    precision = prior_precision(model.solver, fit, start)
    precision += np.diag(np.append(np.zeros(len(fit.inverse)), anywhere / shapes**2))
    for group in fit.state.groups:
        known = model.candidate(group).known(model.solver.values(fit, group))
        if known is not None:
            chosen = _numbers_of(model, group, places.get(group))
            units = _units(model, group, shapes, places.get(group))
            precision[np.ix_(chosen, chosen)] += known / np.outer(units, units)
    return ShapedFit(
        model, block_covariance(rows, rows.gram(), precision, settings.guards.robust_variance), places, shapes
    )


def _numbers_of(model: FittedModel, group: int, place: slice | None) -> list[int]:
    """Where a group's coefficients stand among the parameters of a fit, and then its shapes."""
    columns = model.solver.groups[group].columns
    start = model.fit.links.shape[1] + int(np.flatnonzero(model.fit.columns == columns[0])[0])
    return [*range(start, start + len(columns)), *_places(place)]


def _units(model: FittedModel, group: int, shapes: Array, place: slice | None) -> Array:
    """Lengths of a group's columns, and of those of its shapes. shapes: lengths of all."""
    before = len(model.fit.inverse)
    own = [shapes[number - before] for number in _places(place)]
    return np.append(model.moments.lengths[model.solver.groups[group].columns], own)
