"""The compiled fit of sinusoids beside the same method in plain NumPy."""

import numpy as np
import pytest
from scipy.linalg import svd

from patchfem.response.ringing import _fitted, _forced, ring


def columns_of(time, forced, poles):
    """The given columns, then those of the sinusoids, as written."""
    out = [*forced.T]
    for own, rate in poles.reshape(-1, 2):
        fall = np.exp(-rate * time)
        out += [fall * np.cos(own * time), fall * np.sin(own * time)]
    return np.stack(out, axis=1)


def looked(time, value, forced, poles, scale):
    """(what is left (k,), its slopes by poles/scale (k, 2 r)) by the singular values of the columns."""
    columns, n = columns_of(time, forced, poles), forced.shape[1]
    basis, sizes, turned = svd(columns, full_matrices=False)
    counts = sizes > 1e-12 * sizes[0]
    basis = basis[:, counts]
    numbers = turned[counts].T @ (basis.T @ value / sizes[counts])
    slopes = np.empty((time.size, poles.size))
    for k in range(poles.size // 2):
        cosine, sine = columns[:, n + 2 * k], columns[:, n + 2 * k + 1]
        a, b = numbers[n + 2 * k:n + 2 * k + 2]
        slopes[:, 2 * k], slopes[:, 2 * k + 1] = b * cosine - a * sine, -(a * cosine + b * sine)
    slopes *= time[:, None] * scale
    return value - basis @ (basis.T @ value), basis @ (basis.T @ slopes) - slopes


def plain(time, value, forced, poles, whole, short):
    """Levenberg and Marquardt's method as `fitted` has it: (poles, sum of squares, normal equations)."""
    scale, damping, count = np.abs(poles) + 1 / time[-1], 1e-3, 1
    left, slopes = looked(time, value, forced, poles, scale)
    while count <= 60:
        normal, pull, size = slopes.T @ slopes, slopes.T @ left, left @ left
        if size <= (4 * 2.0**-52)**2 * (value @ value) or (size < whole and poles[::2].max() < short):
            break
        step = -np.linalg.solve(normal + damping * np.diag(np.diag(normal)), pull)
        if -pull @ step <= 2.0**-52 * size:
            break
        new, count = looked(time, value, forced, poles + scale * step, scale), count + 1
        if new[0] @ new[0] <= size:
            poles, (left, slopes), damping = poles + scale * step, new, damping / 10
            if np.abs(step).max() < 1e-13:
                break
        elif damping > 1e9 or np.abs(step).max() < 1e-15:
            break
        else:
            damping *= 10
    return poles, left @ left, np.column_stack([slopes.T @ slopes, slopes.T @ left])


def case(seed, rings, omega=3.0, samples=121, noise=1e-4):
    """A forced sine with rings and noise, and poles a little off those of the rings."""
    r, time = np.random.default_rng(seed), np.linspace(0, 1.0, samples)
    poles = np.array([(2 * np.pi * r.uniform(6 + 9 * k, 9 + 9 * k), r.uniform(0.1, 3)) for k in range(rings)]).ravel()
    forced = _forced(time, omega)
    value = columns_of(time, forced, poles) @ r.normal(size=forced.shape[1] + 2 * rings)
    value += noise * r.normal(size=samples)
    return time, value, forced, poles * r.uniform(0.97, 1.03, poles.size)


@pytest.mark.parametrize("omega", [0.0, 3.0])
@pytest.mark.parametrize("rings", [1, 2, 3])
def test_exact_the_fit_is_the_plain_one(rings, omega):
    for seed in range(4):
        time, value, forced, start = case(seed, rings, omega)
        want, size, normal = plain(time, value, forced, start, 1e-20, 1.0)
        poles = start.copy()
        _, left, (*_, products, _) = _fitted(time, value, forced, poles, (4 * 2.0**-52)**2 * (value @ value), 1e-20,
                                                 1.0)
        assert poles == pytest.approx(want, rel=1e-7) and left == pytest.approx(size, rel=1e-10)
        assert products[:, :-1] == pytest.approx(normal[:, :-1], rel=1e-5)


def test_exact_without_steps_a_fit_is_the_projection():
    time, value, forced, poles = case(7, 2)
    kept = poles.copy()
    found, left, (columns, few, *_) = _fitted(time, value, forced, poles)
    want = looked(time, value, forced, kept, np.ones(4))[0]
    assert found == 1 and np.array_equal(poles, kept)
    assert columns[2, 0] == pytest.approx(want, abs=1e-13 * np.abs(value).max()) and left == pytest.approx(want @ want)
    assert few[-1] @ columns[0] + columns[2, 0] == pytest.approx(value, rel=1e-12)


def test_exact_columns_that_others_make_up_count_for_nothing():
    """A sinusoid of the drive's own frequency that does not decay leaves what the forced sine leaves."""
    time, value, forced, _ = case(3, 1)
    alone = _fitted(time, value, forced, np.empty(0))[1]
    for same in (np.array([3.0, 0.0]), np.array([3.0, 0.0, 3.0, 0.0])):
        assert _fitted(time, value, forced, same)[1] == pytest.approx(alone, rel=1e-12)


def test_refuses_a_signal_that_is_no_number():
    time, value, forced, poles = case(1, 1)
    value[5] = np.nan
    assert _fitted(time, value, forced, poles, 0.0, 0.0, 1.0)[1] == np.inf
    assert ring(time, value, 3.0) is None
