"""Drives far below the modes: long leaps agree with short ones, their number does not grow with the cycles of the mode,
and the limit of slow motion is that of statics."""

import event_run
import numpy as np
import pytest
from event_reference import basis_of

from patchfem.core import BaseSine
from patchfem.response.measures import energy_balance


@pytest.mark.parametrize("zeta", [0.01, 1.0, 5.0])
def test_exact_the_limit_of_slow_motion_is_statics(zeta):
    """A spring behind a sliding block: the slide lags by the limit over the stiffness, each cycle loses four times the
    limit times the slide's amplitude; the block sticks while the drive falls from its peak by twice the limit."""
    omega = 1e-4
    done = event_run.simulate(basis_of(1.0, zeta), BaseSine(1.0, omega), 0.3, 0.3, 3, 1)
    (loop,) = done.loops
    assert done.amplitudes[-1] == pytest.approx([-0.7, 0.7], abs=1e-5)
    assert loop.work == pytest.approx(4 * 0.3 * 0.7, rel=1e-5) and loop.force == pytest.approx(0.3, rel=1e-12)
    assert loop.stuck == pytest.approx(2 * np.arccos(1 - 2 * 0.3) / omega, rel=4 * (zeta + 0.1) * omega)
    assert energy_balance(done.ledger) < 1e-11
