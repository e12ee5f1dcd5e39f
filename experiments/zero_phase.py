"""A low-pass filter without delay."""

from __future__ import annotations

import numpy as np

from ..models import Array


def zero_phase(
    signal: Array, cut_off: float, rate: float, order: int = 5, *, mirrored: bool = False
) -> Array:
    """Butterworth low-pass of an order, applied forwards and backwards, to a signal (k,).

    The magnitude 1 / (1 + (f / f_c)^(2 order)) of both passes together is applied to the spectrum of the
    signal, continued at both ends by its point reflection, which keeps the slope; or mirrored, where a noisy
    end should weigh no more than other samples.
    """
    pad = len(signal) - 1
    head, tail = signal[pad:0:-1], signal[-2 : -pad - 2 : -1]
    if not mirrored:
        head, tail = 2 * signal[0] - head, 2 * signal[-1] - tail
    long = np.concatenate([head, signal, tail])
    trend = np.linspace(long[0], long[-1], len(long))
    f = np.fft.rfftfreq(len(long), 1.0 / rate)
    spectrum = np.fft.rfft(long - trend) / (1.0 + (f / cut_off) ** (2 * order))
    smooth: Array = (np.fft.irfft(spectrum, len(long)) + trend)[pad : pad + len(signal)]
    return smooth
