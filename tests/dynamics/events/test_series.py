"""Series of the motion against the matrix exponential, roots against those of the companion matrix."""

import numpy as np
import pytest
from scipy.linalg import expm

from patchfem.compiled.plain import plain
from patchfem.core import ModalBasis
from patchfem.dynamics.events.plant import plant_of, room_of

series, drives = plain("patchfem.dynamics.events.series_kernels"), plain("patchfem.dynamics.events.drive_kernels")


def chain(random, count, coupled):
    """A basis with a rigid, an overdamped and other modes."""
    omega = np.sort(random.uniform(0.3, 9.0, count))
    omega[0] = 0.0 if count > 1 else omega[0]
    zeta = random.uniform(0.001, 0.3, count)
    zeta[-1] = 2.5 if count > 2 else zeta[-1]
    dampers = random.normal(size=(count, count)) if coupled else None
    slide, base, output = random.normal(size=(3, count))
    return ModalBasis(tuple("abcde"[:count]), omega, zeta, slide, base, output, 1.7,
                      None if dampers is None else dampers @ dampers.T)


@pytest.mark.parametrize(("count", "coupled"), [(1, False), (2, False), (2, True), (3, False), (5, True)])
def test_exact_series_is_the_exponential_of_its_system(count, coupled):
    random = np.random.default_rng(count)
    modes, spring, force = chain(random, count, coupled), 3.0, 0.4
    plant = plant_of(modes)
    room, motion = room_of(plant), random.normal(size=(2, count))
    rate = max(series.fastest(plant, np.array([spring])), 2.0)
    h, theta, drive = series.REACH / rate, 0.7, np.array([0.3, 1.5, 2.0])
    segment = np.array([0.0, 0.0, drives.SINE, *drive, theta, 0.0, 0.0, 2.0, 0.0, 0.0])
    top = series.powers(rate * h)
    drives.drive_series(segment, 0.0, 0.0, np.pi, h, top, room.waves)
    series.motion_series(*motion, np.array([force]), np.array([spring]), plant, room.waves[0], h, top, room.coefs,
                         room)
    # state z, v, 1, a sin, a cos of the same system
    big = np.zeros((2 * count + 3, 2 * count + 3))
    held = np.diag(modes.omega**2) + spring / modes.mass * np.outer(modes.slide, modes.slide)
    big[:count, count:2 * count] = np.eye(count)
    big[count:2 * count, :count], big[count:2 * count, count:2 * count] = -held, -modes.dampers
    start = modes.slide * (force - spring * modes.slide @ motion[0]) / modes.mass
    big[count:2 * count, 2 * count], big[count:2 * count, 2 * count + 1] = -modes.base * drive[0] - start, -modes.base
    big[2 * count + 1, 2 * count + 2], big[2 * count + 2, 2 * count + 1] = drive[2], -drive[2]
    first = np.concatenate([*motion, [1.0, drive[1] * np.sin(theta), drive[1] * np.cos(theta)]])
    for u in (0.3, 1.0):
        want = expm(big * h * u) @ first
        found = [sum(c * u**k for k, c in enumerate(room.coefs[:top + 1, i])) for i in range(count)]
        np.testing.assert_allclose(found, want[:count], atol=3e-14 * np.abs(want[:2 * count]).max())


def test_exact_first_root_of_a_long_series_is_the_first_of_several():
    random, rooms = np.random.default_rng(4), np.zeros((series.DEEP + 2, series.WIDE))
    later = 0
    for case in range(400):
        places = np.sort(random.uniform(0.02, 1.4, int(random.integers(1, 5))))
        if case % 4 == 0:
            places = np.append(places, places[0] + 10.0**random.uniform(-5, -1))  # a pair
        poly, factor = np.array([1.0]), random.uniform(-2, 2)
        for place in places:
            poly = np.convolve(poly, [1.0, -1 / place])
        # exp(factor u) has no root; its terms beyond the 20th are below round-off
        poly = np.convolve(poly, np.cumprod([1.0, *(factor / k for k in range(1, 21))]))
        low = case % 2  # a series that begins with a power of u
        row = np.zeros(series.MOST + 4)
        row[low:low + poly.size] = poly
        found = series.first_root(row, low, low + poly.size - 1, rooms)
        first = places.min()
        slope = np.polyval(np.polyder(poly[::-1]), first)
        near = 1e-15 * np.polyval(np.abs(poly)[::-1], first) / abs(slope) + 1e-15  # what round-off moves a root
        assert found == (series.NONE if first > 1 else pytest.approx(first, abs=near)), places
        if first <= 1:
            look = series.first_look(row, low, low + poly.size - 1, rooms[0])
            lone = series.lone_root(row, low, low + poly.size - 1, look, rooms)
            assert lone == series.NONE or lone == pytest.approx(first, abs=near)
            later += lone == series.NONE
    assert later < 200  # most are found the short way


@pytest.mark.parametrize("seed", range(4))
def test_exact_largest_value_of_a_polynomial(seed):
    random = np.random.default_rng(seed)
    poly = random.normal(size=12) / np.arange(1, 13)
    row = np.zeros(series.MOST + 2)
    row[:12] = poly
    turns = np.roots((poly[1:] * np.arange(1, 12))[::-1])
    turns = turns[(abs(turns.imag) < 1e-12) & (turns.real > 0) & (turns.real < 1)].real
    want = np.abs(np.polyval(poly[::-1], np.concatenate([turns, [0.0, 1.0]]))).max()
    found = series.largest(row, 11, 0.0, np.zeros((series.DEEP + 2, series.WIDE)))
    assert found == pytest.approx(want, rel=1e-13)
    assert series.largest(row, 11, 2 * want, np.zeros((series.DEEP + 2, series.WIDE))) == 2 * want
