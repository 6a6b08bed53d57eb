"""A profile on the mesh that the tolerance chooses: it is averaged over cells that follow the tolerance."""

from __future__ import annotations

import numpy as np
import pytest
from scene_texts import COATING, PIECE

import patchfem as pf
from patchfem import build
from patchfem.closed_forms import contact as closed_forms
from patchfem.runs.patch import fine as trace
from patchfem.scene import loads

SKIN = (
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e14 Pa/m"\ntangential_ratio = 0.8\n'
)


def pressed(tmp_path, x, z, text, *settings):
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist()))
    (tmp_path / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    scene = text + '[contact.profile]\nfile = "trace.csv"\n'
    return pf.run(loads(scene, tmp_path / "scene.toml", sets=settings))


@pytest.mark.parametrize("tolerance", [1e-2, 1e-3, pytest.param(1e-4, marks=pytest.mark.slow)])
def test_a_punch_with_rounded_ends_from_a_file_is_that_in_closed_form(tmp_path, tolerance):
    """Its flat is a sixteenth of the pieces, which lowers the peak of half planes by some 1.7e-3. The averages over
    a two-hundredth of the length were 12 % off behind a bar of 0.1 %."""
    flat = 0.5e-3
    radius = 20e-3
    load = 5e4
    x = np.linspace(-8e-3, 8e-3, 8001)
    z = np.maximum(np.abs(x) - flat, 0) ** 2 / (2 * radius)
    text = (
        '[contact]\nlength = "16 mm"\nwidth = "1 m"\nheight = "8 mm"\nload = "50 kN"\n'
        'substrate = {young = "120 GPa", poisson = 0.32, density = "4370 kg/m^3"}\n'
    )
    found = pressed(tmp_path, x, z, text, f"accuracy.tolerance={tolerance}")
    modulus = closed_forms.combined_modulus(120e9, 0.32)
    half = closed_forms.rounded_punch_half_width(load, flat, radius, modulus)
    top = closed_forms.rounded_punch_pressure(
        np.linspace(flat, half, 4001), load, flat, radius, modulus
    ).max()
    for name, truth, share in (("pressure_peak", top, 2e-3), ("contact_half_width", half, 4e-4)):
        measure = found.measures[name]
        assert abs(measure.value - truth) <= measure.error + share * truth, name
        assert measure.error <= tolerance * truth or found.warnings


@pytest.mark.share(0)
@pytest.mark.parametrize("size", ["", "32 um"])
def test_beside_asperities_the_stiffness_does_not_hang_on_the_cells(tmp_path, size):
    """The trace ends and the law begins at a hundredth of the length, whatever the mesh; a note names it."""
    x = np.linspace(-6.35e-3, 6.35e-3, 3176)
    z = 0.2e-6 * np.cos(2 * np.pi * x / 1.27e-3) + 0.1e-6 * np.cos(2 * np.pi * x / 90e-6)
    text = PIECE + 'load = "26 lbf"\nsubstrate = "steel"\n' + SKIN
    even = pressed(tmp_path, x, z, text, "contact.element_size=16 um").measures["normal_stiffness"]
    found = pressed(tmp_path, x, z, text, *([f"contact.element_size={size}"] if size else []))
    mine = found.measures["normal_stiffness"]
    assert abs(mine.value - even.value) <= mine.error + even.error
    assert mine.value == pytest.approx(even.value, rel=5e-3)
    assert any(
        "waves longer than 127 um give the shape of the gap" in text for text in found.warnings
    )


# studies/contact/order_four.py, an independent program: contact interval [m], approach [m], peak [Pa], stiffness [N/m]
CROWN = (2 * 3.7177189e-4, 2.8687086e-7, 1.46972585e7, 3.66814797e10 * 12.7e-3)


def on_points(tmp_path, x, z, text, *settings):
    """Static measures of a profile from points as fine as its file, (value, error) by name."""
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(x.tolist(), z.tolist()))
    (tmp_path / "trace.csv").write_text(f"x [m],z [m]\n{rows}\n", "utf-8")
    asked = build(
        loads(
            text + '[contact.profile]\nfile = "trace.csv"\n', tmp_path / "scene.toml", sets=settings
        )
    ).patch
    assert trace.can_use_points(asked)
    return trace.solve_on_points(asked, lambda found: True).measures


def test_points_as_fine_as_a_file_hold_an_independent_program(tmp_path):
    """A crown of 1 m read from a file of 1001 samples, on the coated pieces of the rig."""
    x = np.linspace(-6.35e-3, 6.35e-3, 1001)
    found = on_points(
        tmp_path, x, x**2 / 2, PIECE + 'load = "26 lbf"\nsubstrate = "Ti-8Al-1Mo-1V"\n' + COATING
    )
    names = ("contact_half_width", "approach", "pressure_peak", "normal_stiffness")
    for name, truth in zip(names, (CROWN[0] / 2, *CROWN[1:]), strict=True):
        value, error, _ = found[name]
        assert abs(value - truth) <= error + 5e-6 * truth, name
        assert error <= 1e-3 * truth, name


@pytest.mark.parametrize(
    "pieces",
    [
        "contact.lower.coating=none",
        pytest.param("contact.load_line.offset=1.5 mm", marks=pytest.mark.slow),
        pytest.param("contact.plane=stress", marks=pytest.mark.slow),
    ],
)
def test_points_and_cells_agree_within_their_bars(tmp_path, pieces):
    """A wave of a tenth of the length under a free rotation, of unlike pieces, in plane stress."""
    x = np.linspace(-6.35e-3, 6.35e-3, 1271)
    z = 0.1e-6 * np.cos(2 * np.pi * x / 1.27e-3)
    text = PIECE + 'load = "500 N"\nsubstrate = "steel"\n' + COATING
    points = on_points(tmp_path, x, z, text, pieces)
    even = pressed(tmp_path, x, z, text, pieces, "contact.element_size=16 um").measures
    # the shear of unlike pieces is left to the cells
    assert len(points) == (11 if "lower" in pieces else 12)
    for name, (value, error, _) in points.items():
        assert abs(value - even[name].value) <= error + even[name].error + even[name].floor, name
        if name in ("approach", "pressure_peak", "normal_stiffness"):
            assert error <= 2e-3 * abs(value), name
