"""How far links may be from the simulation: a normal prior whose width a link is found in the data.

The metric is that of the pseudo-inertias at the nominal bodies, which no choice of frame changes (Lee and Park 2018):
a width of 0.05 is a body that is about 5 % off in every direction. Width zero is a link exactly as simulated.
"""

from dataclasses import dataclass

import numpy as np

from armlab.common.arrays import Array
from problem.arm import Arm, Link
from problem.base_parameters import BaseParameters
from problem.pseudo_inertia import entropic_information, regular_nominal

Widths = tuple[float, ...]
MIN_VARIANCE_RATIO = 1e-12  # of the largest variance of a base parameter, in scaled columns


@dataclass(frozen=True, eq=False)
class LinkPrior:
    """covariances: (joints, 10, 10) of each link's parameters at width one. grouping: (base, 10 * joints)."""

    covariances: Array
    grouping: Array

    @property
    def links(self) -> int:
        """Number of links."""
        return len(self.covariances)

    def spread(self, widths: Widths) -> Array:
        """Covariance of the base parameters, (base, base)."""
        out = np.zeros((len(self.grouping), len(self.grouping)))
        for link, width in enumerate(widths):
            part = self._part(link)
            out += width**2 * part @ self.covariances[link] @ part.T
        return out

    def factor(self, widths: Widths, lengths: Array) -> Array:
        """F (base, rank) with F F' = the covariance of base parameters times their columns' lengths."""
        values, vectors = np.linalg.eigh(self.spread(widths) * np.outer(lengths, lengths))
        kept = values > MIN_VARIANCE_RATIO * max(values[-1], 1e-300)
        return np.asarray(vectors[:, kept] * np.sqrt(values[kept]))

    def deviations(self, widths: Widths, base: Array, covariance: Array) -> tuple[Array, Array]:
        """Mean and covariance of all links' parameters, given those of the base parameters' deviation.

        base: (base,), covariance: (base, base). Returns (10 * links,) and (10 * links, 10 * links).
        """
        prior = np.zeros((10 * self.links, 10 * self.links))
        for link, width in enumerate(widths):
            place = slice(10 * link, 10 * link + 10)
            prior[place, place] = width**2 * self.covariances[link]
        gain = prior @ self.grouping.T @ np.linalg.pinv(self.spread(widths), rcond=1e-10, hermitian=True)
        rest = prior - gain @ self.grouping @ prior
        return gain @ base, rest + gain @ covariance @ gain.T

    def _part(self, link: int) -> Array:
        return self.grouping[:, 10 * link : 10 * link + 10]


def link_prior(arm: Arm, base: BaseParameters, inertial: Array) -> LinkPrior:
    """The prior about nominal links with parameters (10 * joints,), all of them bodies."""
    links = tuple(Link(float(ten[0]), tuple(ten[1:4]), tuple(ten[4:])) for ten in inertial.reshape(-1, 10))
    nominal = Arm(arm.name, arm.joints, links, arm.gravity)
    metric = entropic_information(regular_nominal(nominal))
    blocks = [metric[at : at + 10, at : at + 10] for at in range(0, len(metric), 10)]
    return LinkPrior(np.stack([np.linalg.inv(block) for block in blocks]), base.grouping)
