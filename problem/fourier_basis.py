"""The terms of a finite Fourier series in Swevers' form, and their time derivatives."""

import numpy as np

from problem.transforms import Array


def fourier_terms(times: Array, duration: float, harmonics: int) -> Array:
    """sin(w k t) / (w k) and -cos(w k t) / (w k) for k = 1 .. harmonics, w = 2 pi / duration.

    (Swevers 1997, eq. 8; the Fourier part of eq. 45-47.) Returns (3, samples, 2 * harmonics): values,
    first and second derivatives; sines first.
    """
    order = 2 * np.pi / duration * np.arange(1, harmonics + 1)
    sine, cosine = np.sin(np.outer(times, order)), np.cos(np.outer(times, order))
    values = np.hstack([sine / order, -cosine / order])
    rates = np.hstack([cosine, sine])
    return np.stack([values, rates, np.hstack([-sine * order, cosine * order])])


def times_window(terms: Array, window: Array) -> Array:
    """Product of terms (3, samples, n) with a window (3, samples), derivatives by Leibniz' rule."""
    f, df, ddf = terms
    w, dw, ddw = (part[:, None] for part in window)
    return np.stack([f * w, df * w + f * dw, ddf * w + 2 * df * dw + f * ddw])
