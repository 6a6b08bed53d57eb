"""Fourier series x(theta) = Re sum_k X_k exp(i k theta), k = 0 to H, of periodic motions."""

import numpy as np

N_SAMPLES = 4096  # samples per cycle from which the extremes of a motion are found


def evaluate_series(x, samples: int) -> np.ndarray:
    """Evaluate series (..., H + 1) at N > 2 H equal samples of a cycle (..., N)."""
    spectrum = np.zeros((*x.shape[:-1], samples // 2 + 1), complex)
    spectrum[..., : x.shape[-1]] = x * (samples / 2)
    spectrum[..., 0] *= 2
    return np.fft.irfft(spectrum, samples, axis=-1)


def find_harmonics(values, harmonics: int) -> np.ndarray:
    """Return the harmonics (..., H + 1) of samples (..., N) of a cycle, H <= N/2."""
    x = np.fft.rfft(values, axis=-1)[..., : harmonics + 1] * (2 / values.shape[-1])
    x[..., 0] /= 2
    return x


def pack_harmonics(x) -> np.ndarray:
    """Pack harmonics (r, H + 1) into a real vector (r (2 H + 1),).

    Each row has the real parts of k = 0 to H, then the imaginary parts of k = 1 to H.
    """
    return np.concatenate([x.real, x.imag[:, 1:]], axis=1).ravel()


def unpack_harmonics(packed, rows: int) -> np.ndarray:
    """Return the harmonics (rows, H + 1) in a vector of `pack_harmonics`."""
    packed = packed.reshape(rows, -1)
    h = packed.shape[1] // 2
    x = packed[:, : h + 1].astype(complex)
    x[:, 1:] += 1j * packed[:, h + 1 :]
    return x


def find_peak(y) -> float:
    """Return the maximum of a sampled cycle (N,), interpolated by a parabola.

    The largest of 4096 samples of a sine can be (pi/4096)^2/2 = 3e-7 too small.
    """
    k = int(np.argmax(y))
    a = y[k - 1]
    b = y[k]
    c = y[(k + 1) % y.size]
    bend = a - 2 * b + c
    return float(b - (a - c) ** 2 / (8 * bend)) if bend < 0 else float(b)


def half_range(x) -> float:
    """Return half the peak-to-peak value of a motion given by its harmonics (H + 1,)."""
    motion = evaluate_series(np.asarray(x), N_SAMPLES)
    return (find_peak(motion) + find_peak(-motion)) / 2


def find_loss(slides, forces) -> float:
    """Return the work per cycle [J] of forces [N] on slides [m], both (i, H + 1) harmonics."""
    k = np.arange(slides.shape[1])
    return np.pi * float(np.sum(k * (slides.conj() * forces).imag))
