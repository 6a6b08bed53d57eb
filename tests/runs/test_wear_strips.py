"""Wear of patches in strips, each by its own pressure and slip: comparison with slip amplitudes
and closed forms."""

import numpy as np
import pytest
from scene_texts import COATED, COULOMB, MODE, PIECE

import patchfem as pf

STRIPS = "[contact.strips]\ncount = 4\n"
ROLLED = STRIPS + 'roll = "0.1 mrad"\n'
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\ncycles = 2\n'
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 135723\n'
LARGE_TOLERANCE = "[accuracy]\ntolerance = 1e-2\n"
BASE_DRIVE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 60\n'
LOAD = 26 * 4.4482216152605


def final_depth(result) -> np.ndarray:
    """Return the worn depth of the last frame [m]."""
    return result.fields["worn_depth"][-1]


def test_exact_worn_depth_of_rolled_rigid_pad_agrees_with_closed_form():
    """On a Winkler foundation in full contact, the pressure tends to the mean: p = p_mean + (p_0 -
    p_mean) exp(-kappa s k N)."""
    rigid_pieces = (
        PIECE
        + 'load = "26 lbf"\nelement_size = "4 mm"\nsubstrate = {young = "1e17 Pa", poisson = 0.3, '
        'density = "1000 kg/m^3"}\n'
    )
    skin = '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e12 Pa/m"\n'
    k = 1e12
    n = 5e4
    result = pf.run(
        rigid_pieces
        + skin
        + ROLLED.replace("0.1", "0.05")
        + COULOMB
        + SINE
        + WEAR.replace("135723", "5e4")
        + "[accuracy]\ntolerance = 1e-4\n"
    )
    y = (np.arange(4) - 1.5) * 12.7e-3 / 4
    mean = LOAD / 12.7e-3**2
    pressure_deviation = -k * 0.05e-3 * y
    assert (mean + pressure_deviation > 0).all()
    wear_per_pressure = 1e-14 * 40e-6 * n
    expected = mean * wear_per_pressure + pressure_deviation / k * (
        1 - np.exp(-wear_per_pressure * k)
    )
    assert np.abs(final_depth(result) - expected[:, None]).max() < 2e-4 * expected.max()


def test_exact_strips_of_rig_wear_by_their_own_slip():
    """The worn volume of each strip follows from its own slip amplitude; a note states the lateral motion."""
    mode = MODE + 'yaw = "20 rad/m"\n'
    result = pf.run(
        COATED
        + STRIPS
        + COULOMB
        + mode
        + BASE_DRIVE
        + WEAR.replace("135723", "1e3")
        + "jumps = 1\n"
        + LARGE_TOLERANCE
    )
    slides = result.window.extra["slides"]
    last_cycle = result.window.time >= result.window.time[-1] - (1 + 1e-9) / 143
    volumes = final_depth(result).mean(axis=1) * 12.7e-3**2 / 4
    expected = np.ptp(slides[last_cycle], axis=0) / 2
    assert np.ptp(expected) > 1e-2 * expected.mean()
    assert volumes == pytest.approx(1e-14 * LOAD / 4 * 4 * expected * 1e3, rel=5e-3)
    assert sum("across x" in note for note in result.notes) == 1
