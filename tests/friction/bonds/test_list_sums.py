"""The sum over bonds for every order and both forms of the law, compared with closed forms and a sum by hand."""

import numpy as np
import pytest
from friction_paths import (
    LowerPressure,
    march_bonds,
    reference_traction,
    upper_pressure,
)

from patchfem.friction import Bonds

TWO_PRESSURES = upper_pressure([1.0, 0.25])
PLACES = np.linspace(-40.0, 40.0, 9)
GROWTH = {"ratio": 0.6, "rest_growth": 0.3, "slip_growth": 0.4, "rest_speed": 1e-2}


def random_displacements(seed, n_steps, step_scale=0.7):
    """Return a path of random displacements that starts at 0."""
    return np.concatenate(
        [[0], np.cumsum(np.random.default_rng(seed).normal(0, step_scale, n_steps))]
    )


# ---- closed strips


@pytest.mark.parametrize(
    "pressure", [TWO_PRESSURES, LowerPressure(PLACES, 1.5 + np.sin(0.4 * PLACES))]
)
@pytest.mark.parametrize("reading, order", [("report", 0.0), ("report", 2.0), ("stretch", 1.0)])
def test_exact_pressure_on_upper_or_lower_piece(reading, order, pressure):
    """The traction agrees with a sum by hand for a pressure fixed to the upper or to the lower piece.

    For reading="stretch" the error is that of two Gauss points per strip.
    """
    law = Bonds(1.0, 1.0, order, reading, initial=0.5)
    path = random_displacements(5, 40)
    run = march_bonds(law, path, pressure, tail=0.0)
    tolerance = 3e-8 if reading == "stretch" else 1e-12
    # The outermost points of a pressure on the lower piece leave it on the way.
    inner = slice(1, -1) if isinstance(pressure, LowerPressure) else slice(None)
    expected = reference_traction(law, path, pressure)[inner]
    assert run.traction[-1, inner] == pytest.approx(expected, abs=tolerance)


# ---- Gauss strips


# ---- extreme values


@pytest.mark.share(0, 9)
@pytest.mark.parametrize(
    "reading, order",
    [("report", -0.5), ("report", 0.0), ("report", 2.0), ("stretch", 0.0), ("stretch", 2.0)],
)
@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_exact_rests_and_long_steps_are_handled(reading, order, growth):
    """Rests and a step of a thousand bond lengths give finite tractions, and without growth the friction limit."""
    law = Bonds(1.0, 1.0, order, reading, **growth)
    path = np.array([0.0, 0.0, 0.3, 0.3, 1e3, 1e3])
    run = march_bonds(law, path, TWO_PRESSURES, 1.0, 1e-9)
    assert np.isfinite(run.mean).all() and np.isfinite(run.traction).all()
    assert not run.traction[0].any()
    # in the printed law, loaded bonds heal at rest and the force changes without motion
    if reading == "stretch" or not growth:
        assert run.traction[3] == pytest.approx(run.traction[4], rel=1e-12)
        assert run.mean[4] == pytest.approx(run.traction[4].sum(), rel=1e-12)
    if not growth:
        assert run.traction[4] == pytest.approx([1.0, 0.25], rel=1e-3)
        assert run.traction[2] == pytest.approx(run.traction[1], rel=1e-14)


def test_exact_dwell_does_not_grow_next_strip():
    """A dwell lengthens only the bonds that exist during the dwell, not those of the next strip."""
    law = Bonds(
        1.0,
        1.0,
        1.0,
        "report",
        ratio=0.5,
        rest_growth=0.1,
        slip_growth=0.2,
        rest_speed=1e-2,
        initial=0.0,
    )
    path = np.concatenate([np.linspace(0, 2, 41), [2.0, 2.05]])
    times = np.append(np.full(40, 0.5), [1.0, 0.5])
    force = march_bonds(law, path, upper_pressure([1.0]), times, 0.0).traction[-1, 0]
    assert force == pytest.approx(
        reference_traction(law, path, upper_pressure([1.0]), times)[0], abs=2e-4
    )
