"""Errors of static patches cover references: narrow contacts, steps, peaks, and random scenes of an
independent program."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scene_texts import PIECE
from static_scenes import JUDGED, KINDS, draw_scene, format_scene, reliable_rows, solve_reference

import patchfem as pf

TITANIUM = 'substrate = {young = "120 GPa", poisson = 0.32, density = "4370 kg/m^3"}\n'
NARROW = (
    '[contact]\nlength = "40 mm"\nwidth = "1 m"\nheight = "20 mm"\nload = "9100 N"\n'
    + TITANIUM
    + '[contact.crown]\nradius = "1 m"\n'
)
PAD = (
    PIECE
    + 'load = "2000 N"\nsubstrate = {young = "1e8 GPa", poisson = 0.3, density = "4400 kg/m^3"}\n'
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e12 Pa/m"\n'
    '[contact.step]\nheight = "20 um"\nat = "2 mm"\n'
)
CROWNED = (
    '[contact]\nlength = "22.837 mm"\nwidth = "2.1229 mm"\nheight = "12.627 mm"\nload = "744.99 N"\n'
    'substrate = "WC-Co"\nplane = "stress"\n[contact.tilt]\nangle = "6.352e-06 rad"\n[contact.crown]\n'
    'radius = "2628.5 mm"\n[contact.step]\nheight = "0.1773 um"\nat = "0.5519 mm"\n'
)
COATED = (
    '[contact]\nlength = "14.584 mm"\nwidth = "47.673 mm"\nheight = "26.232 mm"\nload = "18.025 N"\n'
    'substrate = "WC-Co"\n[contact.coating]\nmaterial = "alumina"\nthickness = "0.29487 mm"\n[contact.upper]\n'
    'substrate = {young = "102.25 GPa", poisson = 0.0927, density = "5000 kg/m^3"}\n[contact.tilt]\n'
    'angle = "-2.475e-06 rad"\n[contact.step]\nheight = "0.03429 um"\nat = "-0.03108 mm"\n'
)

WORN = (
    PIECE
    + 'load = "2000 N"\n'
    + TITANIUM.replace("120", "121")
    + '[contact.crown]\nradius = "1 m"\n'
    '[friction]\nlaw = "coulomb"\nstatic = 0.3\n[slide]\nkind = "sine"\namplitude = "20 um"\nfrequency = "10 Hz"\n'
    '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 100000\njumps = 1\n'
)


@cache
def run_measures(text: str, tolerance: float) -> dict:
    """Return the measures of a scene at a tolerance."""
    return pf.run(text, **{"accuracy.tolerance": tolerance}).measures


def test_exact_rigid_pad_at_step_has_uniform_pressure():
    """Rigid pieces on a skin touch on 8.35 of 12.7 mm: the pressure is uniform, and the peak does
    not exceed it by an extrapolation."""
    run = pf.run(PAD)
    uniform_pressure = 2000 / (8.35e-3 * 12.7e-3)
    measures_ = run.measures
    references = {
        # The deformation of the pieces changes the pressure by 1e-5.
        "pressure_peak": uniform_pressure,
        "contact_fraction": 8.35 / 12.7,
        "contact_half_width": 4.175e-3,
        "moment": -2000 * 2.175e-3,
        "approach": uniform_pressure / 1e12,
        "normal_stiffness": 1e12 * 8.35e-3 * 12.7e-3,
    }
    for name, reference in references.items():
        assert abs(measures_[name].value - reference) <= measures_[name].error + 1e-5 * abs(
            reference
        ), (
            name,
            measures_[name],
        )
        assert measures_[name].error <= 1e-4 * abs(reference)
    assert (
        measures_["pressure_peak"].value
        <= run.patch.pressure.sigma_n.max() + measures_["pressure_peak"].error
    )


def test_always_errors_of_narrow_contact_cover_spectral_reference():
    """The errors of half-width and contact fraction cover a spectral program (0.4162623 mm). An
    extrapolation by one ratio of three meshes was wrong by 1.46 times its error."""
    narrow = run_measures(NARROW, 1e-3)
    for name, reference in (
        ("contact_half_width", 4.162623e-4),
        ("contact_fraction", 4.162623e-4 / 20e-3),
    ):
        assert abs(narrow[name].value - reference) <= narrow[name].error <= 1e-3 * reference


@pytest.mark.share(0, 1)
@pytest.mark.parametrize(
    "text, name, reference",
    [
        (COATED, "moment", -8.2501e-3),
        (COATED, "contact_half_width", 9.5556e-4),
        (CROWNED, "contact_half_width", 2.99765e-3),
        (CROWNED, "contact_fraction", 0.258252),
    ],
)
def test_always_errors_at_step_cover_reference_and_decrease(text, name, reference):
    """The errors cover the values of `static_reference` and do not grow as the tolerance decreases.
    When a node at the step counted as half, they were 1.2 to 1.6 times too small."""
    previous_error = np.inf
    for tolerance in (1e-2, 1e-3, 1e-4):
        measure = run_measures(text, tolerance)[name]
        assert (
            abs(measure.value - reference) <= measure.error + 1e-5 * abs(reference)
            and measure.error <= previous_error
        ), tolerance
        previous_error = measure.error


@pytest.mark.share(0, 4)
@pytest.mark.parametrize(
    "seed, name, reference, reference_error",
    [
        (7005, "moment", 0.17521083, 1e-5),
        (7017, "moment", -6.73948e-5, 1.4e-9),
        (7029, "normal_stiffness", 220205694.0, 1300.0),
        (7029, "rotational_stiffness", 1541.8782, 0.06),
        (7047, "contact_half_width", 8.724e-3, 0.0),
        (7059, "rotational_stiffness", 201.2822, 0.063),
    ],
)
def test_always_errors_cover_contact_interval_of_one_element(
    seed, name, reference, reference_error
):
    """The errors cover the reference, and do not grow, if a contact interval of one element exists
    only on the finer meshes. The error of the stiffness was 6 times too small in an earlier
    version."""
    previous_error = np.inf
    text = format_scene(draw_scene(seed))
    for tolerance in (1e-3, 1e-4) if seed == 7017 else (1e-2, 1e-3):
        measure = run_measures(text, tolerance)[name]
        assert (
            abs(measure.value - reference) <= measure.error + reference_error
            and measure.error <= previous_error * (1 + 1e-6) + 1e-14
        ), tolerance
        previous_error = measure.error


# Known exceptions by seed: (measure, tolerance). The program states that 95 % of its errors cover
# the true values; of 60 new scenes (seeds 8300000 to 8300059), 99.4 % do at 1e-2 and 98.3 % at
# 1e-3. Successive changes of the stiffness of seed 601 have the ratios 2.8, 5.8 and 4.3; the first
# suggests a wrong order of convergence.
MISSES = {601: {("rotational_stiffness", 1e-3)}}
MAX_MISS = 1.5  # Largest ratio of true to stated error of an exception.


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(600, 600 + len(KINDS)))
def test_always_errors_of_random_patch_cover_independent_program(seed):
    """For one random scene of each kind, the errors cover an independent program, apart from
    MISSES, and do not grow as the tolerance decreases."""
    scene = draw_scene(seed)
    reference, reference_error = solve_reference(scene, 2e-3)
    previous_errors = dict.fromkeys(JUDGED, np.inf)
    for tolerance in (1e-2, 1e-3, 1e-4):
        measures_ = run_measures(format_scene(scene), tolerance)
        rows = reliable_rows(measures_, reference, reference_error)
        misses = [row for row in rows if not row.holds]
        assert {(row.name, tolerance) for row in misses} <= MISSES.get(seed, set())
        assert all(row.true_error <= MAX_MISS * row.error + row.doubt for row in misses)
        names = [name for name in JUDGED if measures_[name].value is not None]
        assert len(rows) > 3
        for name in names:
            assert measures_[name].error <= previous_errors[name] * (1 + 1e-6) + 1e-14, (
                name,
                tolerance,
            )
            previous_errors[name] = measures_[name].error


def test_always_unlike_pieces_have_note_with_dundurs_parameter():
    """A note for unlike pieces states Dundurs' beta, which is 1/2 for a rigid piece on one with a
    Poisson ratio of 0, and the effect of friction; like pieces have no note."""

    def run_notes(nu):
        hard_material = '{young = "1e6 GPa", poisson = 0.3, density = "1 kg/m^3"}'
        soft_material = f'{{young = "1 GPa", poisson = {nu}, density = "1 kg/m^3"}}'
        return pf.run(
            PIECE
            + f'load = "100 N"\nelement_size = "0.5 mm"\nsubstrate = {hard_material}\n[contact.upper]\n'
            f"substrate = {soft_material}\n"
        ).extra["notes"]

    (note,) = [text for text in run_notes(0.0) if "Dundurs" in text]
    assert "beta 0.5 at the interface" in note
    assert float(note.split("normal_stiffness would be ")[1].split(" %")[0]) > 0
    assert not any("Dundurs" in text for text in pf.run(NARROW).extra["notes"])


def test_always_error_of_single_wear_step_covers_peak():
    """A Hertz contact worn in a single step has a peak of 39.4 MPa instead of 30.6 MPa (19 steps);
    the error covers the difference."""
    peak = pf.run(WORN).measures["pressure_peak"]
    assert abs(peak.value - 30.56e6) <= peak.error <= 0.5 * peak.value
