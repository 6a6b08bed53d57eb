"""Bars of static patches against truths: narrow contacts, steps, peaks; random scenes by an independent program."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from scene_texts import PIECE
from static_scenes import JUDGED, KINDS, drawn, judged_rows, solve_reference, text_of

import patchfem as pf
from patchfem import build
from patchfem.model import make_piece_meshes
from patchfem.runs.patch.condensed import condense
from patchfem.runs.patch.press import press_patch

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
def measures(text: str, tolerance: float) -> dict:
    return pf.run(text, **{"accuracy.tolerance": tolerance}).measures


def test_exact_a_pad_beside_a_step_bears_its_load_evenly():
    """Rigid pieces on a skin, 8.35 of 12.7 mm touch: an even pressure, which no node and no parabola exceeds."""
    run = pf.run(PAD)
    even = 2000 / (8.35e-3 * 12.7e-3)
    found = run.measures
    truths = {
        "pressure_peak": even,  # to the 1e-5 that the pieces give
        "contact_fraction": 8.35 / 12.7,
        "contact_half_width": 4.175e-3,
        "moment": -2000 * 2.175e-3,
        "approach": even / 1e12,
        "normal_stiffness": 1e12 * 8.35e-3 * 12.7e-3,
    }
    for name, truth in truths.items():
        assert abs(found[name].value - truth) <= found[name].error + 1e-5 * abs(truth), (
            name,
            found[name],
        )
        assert found[name].error <= 1e-4 * abs(truth)
    assert (
        found["pressure_peak"].value
        <= run.patch.pressure.sigma_n.max() + found["pressure_peak"].error
    )


def test_bars_of_a_narrow_contact_hold_a_half_plane_of_finite_height():
    """Half-width .4162623 mm, of a spectral program; a third mesh extrapolated by one ratio alone was 1.46 bars off."""
    found = measures(NARROW, 1e-3)
    for name, truth in (
        ("contact_half_width", 4.162623e-4),
        ("contact_fraction", 4.162623e-4 / 20e-3),
    ):
        assert abs(found[name].value - truth) <= found[name].error <= 1e-3 * truth


@pytest.mark.share(0, 1)
@pytest.mark.parametrize(
    "text, name, truth",
    [
        (COATED, "moment", -8.2501e-3),
        (COATED, "contact_half_width", 9.5556e-4),
        (CROWNED, "contact_half_width", 2.99765e-3),
        (CROWNED, "contact_fraction", 0.258252),
    ],
)
def test_bars_beside_a_step_hold_and_do_not_widen(text, name, truth):
    """The truths are the reference's of `static_reference`; a node of the step that counts as half was 1.2 to 1.6 bars
    off, and a tighter tolerance had the wider bar."""
    last = np.inf
    for tolerance in (1e-2, 1e-3, 1e-4):
        found = measures(text, tolerance)[name]
        assert (
            abs(found.value - truth) <= found.error + 1e-5 * abs(truth) and found.error <= last
        ), tolerance
        last = found.error


@pytest.mark.share(0, 2, 4)
@pytest.mark.parametrize(
    "seed, name, truth, own",
    [
        (7005, "moment", 0.17521083, 1e-5),
        (7017, "moment", -6.73948e-5, 1.4e-9),
        (7029, "normal_stiffness", 220205694.0, 1300.0),
        (7029, "rotational_stiffness", 1541.8782, 0.06),
        (7047, "contact_half_width", 8.724e-3, 0.0),
        (7059, "rotational_stiffness", 201.2822, 0.063),
    ],
)
def test_bars_of_steps_hold_and_do_not_widen_where_a_stretch_comes_on_a_finer_mesh(
    seed, name, truth, own
):
    """Truths by the reference. A stretch of one cell that two of three meshes saw was 6 bars off in the stiffnesses."""
    last = np.inf
    text = text_of(drawn(seed))
    for tolerance in (1e-3, 1e-4) if seed == 7017 else (1e-2, 1e-3):
        found = measures(text, tolerance)[name]
        assert (
            abs(found.value - truth) <= found.error + own
            and found.error <= last * (1 + 1e-6) + 1e-14
        ), tolerance
        last = found.error


# Errors that do not hold, by seed: (measure, tolerance). The program promises that 95 % hold; of 60 fresh scenes
# (seeds 8300000 to 8300059) 99.4 % do at 1e-2 and 98.3 % at 1e-3. The ratios of successive changes of the stiffness of
# seed 601 are 2.8, 5.8 and 4.3: the first one is steady enough to extrapolate by, and not that of the order.
MISSES = {601: {("rotational_stiffness", 1e-3)}}
MAX_MISS = 1.5  # largest true error of a miss over the stated one


@pytest.mark.share(0)
@pytest.mark.parametrize("seed", range(600, 600 + len(KINDS)))
def test_bars_of_a_random_scene_hold_an_independent_program(seed):
    """One scene of each kind (even pieces always; steps above, by truths of the same program): every bar holds but for
    the MISSES, none widens."""
    scene = drawn(seed)
    true, doubt = solve_reference(scene, 2e-3)
    last = dict.fromkeys(JUDGED, np.inf)
    for tolerance in (1e-2, 1e-3, 1e-4):
        found = measures(text_of(scene), tolerance)
        rows = judged_rows(found, true, doubt)
        misses = [row for row in rows if not row.holds]
        assert {(row.name, tolerance) for row in misses} <= MISSES.get(seed, set())
        assert all(row.true_error <= MAX_MISS * row.error + row.doubt for row in misses)
        known = [name for name in JUDGED if found[name].value is not None]
        assert len(rows) > 3
        for name in known:
            assert found[name].error <= last[name] * (1 + 1e-6) + 1e-14, (name, tolerance)
            last[name] = found[name].error


def test_always_unlike_pieces_say_what_friction_would_change():
    """Dundurs' beta of a rigid face on one of nu 0 is 1/2; alike pieces say nothing."""

    def notes(nu):
        hard = '{young = "1e6 GPa", poisson = 0.3, density = "1 kg/m^3"}'
        soft = f'{{young = "1 GPa", poisson = {nu}, density = "1 kg/m^3"}}'
        return pf.run(
            PIECE
            + f'load = "100 N"\nelement_size = "0.5 mm"\nsubstrate = {hard}\n[contact.upper]\n'
            f"substrate = {soft}\n"
        ).extra["notes"]

    (one,) = [text for text in notes(0.0) if "Dundurs" in text]
    assert "beta 0.5 at the interface" in one
    assert float(one.split("normal_stiffness would be ")[1].split(" %")[0]) > 0
    assert not any("Dundurs" in text for text in pf.run(NARROW).extra["notes"])


def test_always_the_bar_of_a_single_jump_holds_the_worn_peak():
    """Hertz worn in one jump: 39.4 MPa where 30.6 MPa are left (19 jumps); the bar was 7.7 MPa."""
    worn = pf.run(WORN).measures["pressure_peak"]
    assert abs(worn.value - 30.56e6) <= worn.error <= 0.5 * worn.value


@pytest.mark.parametrize("worn, said", [(0.0, 0), (4e-9, 1)])
def test_a_ripple_is_said_where_the_pressure_zigzags(worn, said):
    """One join, which is expected to ripple by 6.7 %: a smooth pressure has none, one on alternating nodes has."""
    asked = build(PIECE + 'load = "2000 N"\nelement_size = "0.5 mm"\n' + TITANIUM).patch
    pair = condense(asked, *make_piece_meshes(asked))
    pair = replace(
        pair, joint=SimpleNamespace(ripple=0.067, reason="is expected to ripple by 6.7 %")
    )
    patch = press_patch(asked, pair, worn * (-1.0) ** np.arange(pair.compliance.interface.x.size))
    assert [text for text in patch.notes if "ripple" in text] == said * [
        "contact.mesh: is expected to ripple by 6.7 %"
    ]
