"""What a piece of full length does, worked out once, against the matrix exponential and the series of each piece."""

import numpy as np
import pytest
from scipy.linalg import expm

from patchfem.compiled import kernels

whole = kernels("dynamics.piecewise_one.whole_kernels")
line = kernels("dynamics.piecewise_one.line_kernels")


@pytest.fixture(scope="module")
def pieces():
    """(regime, table) of full pieces: resonant, stiff, slow and strongly damped ones."""
    out = []
    for alpha, beta, omega in ((0.006, 1.0, 1.0), (0.01, 49.0, 1.0), (0.0, 0.3, 2.0), (3.0, 4.0, 1.5)):
        one, regime = np.zeros((whole.LINES, whole.LONG)), (alpha, beta, 0.0, 0.0, omega)
        whole.work_out(one, regime, 0.01, np.zeros((4, 40)))
        out.append((regime, one))
    return out


def test_exact_whole_piece_is_the_exponential_of_its_system(pieces):
    random = np.random.default_rng(2)
    for (alpha, beta, _, _, omega), one in pieces:
        h, parts = one[0, whole.SPAN], random.normal(size=4)
        # state y, y', 1, drive, quadrature, with y'' = gain - alpha y' - beta y + drive - drive at first
        big = np.array([[0, 1, 0, 0, 0], [-beta, -alpha, parts[1] - parts[2], 1, 0], [0] * 5, [0, 0, 0, 0, omega],
                        [0, 0, 0, -omega, 0]], float)
        want = expm(big * h) @ [0.0, parts[0], 1.0, parts[2], parts[3]]
        _, went, close = whole.one_way(one, tuple(parts), 0)
        np.testing.assert_allclose([went, close], want[:2], rtol=0, atol=2e-14 * np.abs(want).max())
        np.testing.assert_allclose(one[0, [whole.COSINE, whole.SINE]], [np.cos(omega * h), np.sin(omega * h)], 1e-15)
        row, c, wave = np.zeros(whole.LONG), np.zeros(40), np.zeros(40)
        top = int(one[0, whole.TOP])
        line.one_series(0.7, parts[0], parts[1], beta, alpha, parts[2], parts[3], omega * h, h, top, c, wave)
        whole.series_of(one, 0.7, tuple(parts), row)
        np.testing.assert_allclose(row[:top + 1], c[:top + 1], rtol=0, atol=2e-15 * np.abs(c).max())


def test_always_a_speed_said_to_keep_its_sign_does(pieces):
    random, told, u = np.random.default_rng(3), 0, np.linspace(0, 1, 401)
    for k in range(800):
        _, one = pieces[k % 4]
        rests = k % 3 == 0
        parts = random.normal(size=4) * np.exp(random.uniform(-3, 3, 4))
        parts[0] = 0.0 if rests else parts[0]
        row = np.zeros(whole.LONG)
        whole.series_of(one, 0.0, tuple(parts), row)
        speed = np.polyval((row[1:] * np.arange(1, whole.LONG))[::-1], u)
        sign, went, _ = whole.one_way(one, tuple(parts), int(rests))
        keeps = np.all(speed[rests:] * speed[-1] > 0)
        assert sign == 0 or (keeps and sign == np.sign(speed[-1]) == np.sign(went))
        told += sign != 0
        assert not (sign == 0 and keeps and np.abs(speed[rests:]).min() > 0.3 * np.abs(speed).max())
    assert told > 200  # and of many it is said
