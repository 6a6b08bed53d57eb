"""Fraction of the height of a trace in waves that are too short for the elements."""

from __future__ import annotations

import contact_forms as closed_forms
import numpy as np
import pytest
from synthetic import waves

from patchfem.surface import Profile, describe_lost_waves
from patchfem.surface.spectrum import MIN_ELEMENTS_PER_WAVE, wave_spectrum

LENGTH = 12.7e-3
X = np.linspace(0, LENGTH, 4001)


def make_cosines(orders, heights) -> Profile:
    """Return a sum of half-waves of the trace, which are orthogonal to each other and, if even, to a line."""
    return waves(X, heights, [2 * LENGTH / k for k in orders], [np.pi / 2] * len(orders))


@pytest.mark.parametrize("length, fraction", [
    (2 * LENGTH / 1999, 0.0), (2 * LENGTH / 300, 0.0), (2 * LENGTH / 299, 1.0), (2 * LENGTH / 40, 1.0),
    (2 * LENGTH / 39, np.sqrt(5.0)), (2 * LENGTH / 6, np.sqrt(5.0)), (2 * LENGTH / 5, np.sqrt(14.0)),
    (2 * LENGTH, np.sqrt(14.0))])  # fmt: skip
def test_exact_fine_fraction_of_three_waves(length, fraction):
    """The fine fraction of three waves is the root of the squares of the waves shorter than the given length."""
    spectrum = wave_spectrum(make_cosines([6, 40, 300], [3.0, 2.0, 1.0]))
    assert spectrum.lost_fraction(length) == pytest.approx(fraction / np.sqrt(14), abs=1e-9)


@pytest.mark.parametrize("kept, order", [(0.74, 300), (0.7, 40), (0.41, 40), (0.4, 6)])
def test_exact_longest_element_keeps_fraction_of_height(kept, order):
    """Two elements span the shortest wave that may not be lost; waves of rms 1 and sqrt(5) of sqrt(14) are shorter."""
    spectrum = wave_spectrum(make_cosines([6, 40, 300], [3.0, 2.0, 1.0]))
    wave = spectrum.element_length(kept) * MIN_ELEMENTS_PER_WAVE
    assert wave == pytest.approx(2 * LENGTH / order)


def test_exact_lost_waves_are_reported_with_remedy():
    """The message about waves that the mesh does not resolve states their fraction and suitable element sizes.

    Without such waves there is no message.
    """
    profile = Profile(X, make_cosines([20, 500], [2.0, 1.0]).z, "profile.csv")
    assert describe_lost_waves(profile, 100e-6) == (
        "profile.csv has 45 % of its rms height in waves shorter than 2 elements (200 um), which the mesh cannot "
        'resolve: add [contact.asperities], or set element_size = "25.1 um", which keeps 90 % of the height'
    )
    assert describe_lost_waves(profile, 25.1e-6) is None
    assert describe_lost_waves(make_cosines([20, 500], [2.0, 0.1]), 100e-6) is None
    assert describe_lost_waves(Profile(X, 0 * X, "flat.csv"), 1.0) is None


@pytest.mark.parametrize("pressure_ratio", [0.01, 0.3, 0.9])
def test_exact_wave_is_resolved_if_contact_spans_element(pressure_ratio):
    """A wave is resolved if its contact width of Westergaard is at least one element.

    Longer waves have no height here and touch everywhere.
    """
    amplitude = 1e-6
    wavelength = 2 * LENGTH / 40
    spectrum = wave_spectrum(make_cosines([40], [amplitude]))
    closing = closed_forms.westergaard_full_pressure(wavelength, amplitude, 1.0)
    width = 2 * float(
        closed_forms.westergaard_half_width(pressure_ratio * closing, wavelength, amplitude, 1.0)
    )
    largest = min(width, wavelength / 2)
    assert spectrum.shortest_resolved_wave(
        0.99 * largest, pressure_ratio * closing
    ) == pytest.approx(wavelength)
    assert spectrum.shortest_resolved_wave(1.01 * largest, pressure_ratio * closing) > wavelength


def test_exact_full_contact_needs_two_elements_per_wave():
    """In full contact two elements resolve a wave, and at vanishing load no wave is resolved."""
    spectrum = wave_spectrum(make_cosines([2, 40, 300], [1e-6, 1e-6, 1e-6]))
    assert spectrum.shortest_resolved_wave(LENGTH / 300.01, 1.0) == pytest.approx(LENGTH / 150)
    assert spectrum.shortest_resolved_wave(LENGTH / 299.99, 1.0) == pytest.approx(2 * LENGTH / 299)
    rough = Profile(X, np.random.default_rng(1).normal(size=X.size), "rough")
    assert wave_spectrum(rough).shortest_resolved_wave(1e-3, 1e-12) == np.inf
