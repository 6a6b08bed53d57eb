"""Points of a curve where it bends: straight lines between them against the curve of one mode in closed form."""

import numpy as np
import pytest

from patchfem.dynamics import sample_adaptively


def mode(f, zeta):
    """Amplitude over the static one, 1/|1 - r^2 + 2 i zeta r|, of a mode at 143 Hz."""
    r = f / 143.0
    return 1 / np.abs(1 - r**2 + 2j * zeta * r)


@pytest.mark.parametrize("zeta", [1e-3, 3e-3, 0.03, 0.3])
@pytest.mark.parametrize("ends", [(60.0, 210.0), (211.0, 61.0)])
def test_always_straight_lines_miss_a_peak_by_the_share(zeta, ends):
    """Neither end nor spacing knows the mode: at a damping of .003 its half power width is .86 Hz, the spacing 1.25."""
    places, found = sample_adaptively(
        lambda f, near: (mode(f, zeta), f), np.linspace(*ends, 121), 0.01
    )
    assert (
        np.all(np.diff(places) * np.sign(ends[1] - ends[0]) > 0)
        and np.isin(np.linspace(*ends, 121), places).all()
    )
    assert [one[1] for one in found] == list(places) and places.size < 260
    order = np.argsort(places)
    fine = np.linspace(61, 210, 100001)
    lines = np.interp(fine, places[order], np.array([one[0] for one in found])[order])
    assert np.abs(lines / mode(fine, zeta) - 1).max() < 0.01
    assert max(one[0] for one in found) == pytest.approx(
        1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=0.01
    )


@pytest.mark.parametrize("share", [1e-3, 1e-4])
def test_always_a_smaller_share_is_kept_too(share):
    """With no more points than three times those of the best places, int sqrt(|y''|/(8 share y)) df."""
    places, found = sample_adaptively(
        lambda f, near: (mode(f, 3e-3),), np.linspace(120, 170, 6), share
    )
    fine = np.linspace(120, 170, 200001)
    true = mode(fine, 3e-3)
    assert np.abs(np.interp(fine, places, [one[0] for one in found]) / true - 1).max() < share
    bend = np.abs(np.gradient(np.gradient(true, fine), fine))
    assert places.size < 3 * np.sum(np.sqrt(bend / (8 * share * true))) * (fine[1] - fine[0])


def test_always_a_jump_and_a_hole_end():
    """Neither is a bend: a jump is followed to a millionth of its place, nan (no motion is bounded) not at all."""
    places = sample_adaptively(
        lambda f, near: (1.0 if f < 101.3 else np.nan if f > 150 else 5.0,),
        np.linspace(60, 210, 31),
    )[0]
    assert places.size < 100 and np.diff(places).min() < 1e-3
