"""Pieces with rounded edges: their geometry, the rise as part of the gap, and the rounded punch in closed form."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from rounded import rounded_pair

from patchfem.closed_forms import rounded_punch_half_width
from patchfem.closed_forms.contact import rounded_punch_pressure
from patchfem.contact import press
from patchfem.core import Compliance, Interface, Missing, PatchfemError
from patchfem.elasticity import Layers, Substructure
from patchfem.elasticity import interface_compliance as condense
from patchfem.mesh import read_pieces, write_mesh

try:
    import gmsh  # noqa: F401

    broken = False
except (ImportError, OSError):
    broken = True
needs_gmsh = pytest.mark.skipif(broken, reason="extra gmsh is not installed")
TITANIUM = (121e9, 0.32)
SIZES = {"length": 4e-3, "height": 2e-3, "coating": 1.524e-4, "fine": 4e-5, "coarse": 2e-4}


@needs_gmsh
@pytest.mark.parametrize("quads", [False, True])
@pytest.mark.parametrize("radius, flat", [(20e-3, 1e-3), (0.5e-3, None)], ids=["shallow", "fillet"])
def test_exact_geometry_of_rounded_pieces(radius, flat, quads, tmp_path):
    pair = rounded_pair(**SIZES, radius=radius, flat=flat, quads=quads)
    piece = pair.lower
    flat = flat or 1.5e-3
    assert np.array_equal(piece.points[piece.interface], pair.upper.points[pair.upper.interface])
    beyond = np.maximum(np.abs(piece.x) - flat, 0)
    assert piece.interface_depths == pytest.approx(
        radius - np.sqrt(radius**2 - beyond**2), abs=1e-12
    )
    assert piece.interface_depths.max() > 0 and np.count_nonzero(piece.interface_depths == 0) > 10
    assert np.abs(np.diff(piece.interface_depths) / np.diff(piece.x)).max() <= 0.1
    assert (len(piece.quads) > len(piece.triangles)) == quads and piece.height == pytest.approx(
        2e-3
    )
    reach = 2e-3 - flat
    segment = radius * reach - (
        radius**2 * np.arcsin(reach / radius) / 2
        + reach * np.sqrt(max(radius**2 - reach**2, 0)) / 2
    )
    assert piece.areas().sum() == pytest.approx(4e-3 * 2e-3 - 2 * segment, rel=1e-3)
    assert piece.areas()[piece.is_coating].sum() == pytest.approx(4e-3 * 1.524e-4, rel=1e-2)
    write_mesh(pair.lower, tmp_path / "rounded.msh", pair.upper)
    back = read_pieces(tmp_path / "rounded.msh")
    assert np.array_equal(
        back.upper.interface_depths, pair.upper.interface_depths
    ) and np.array_equal(back.lower.x, pair.lower.x)


@needs_gmsh
@pytest.mark.parametrize("quads", [False, True])
def test_exact_rounded_punch_within_one_percent(quads):
    """Two alike pieces: the gaps add up to the radius R/2 on the modulus E'/2."""
    flat = 0.1e-3
    radius = 61e-3
    modulus = TITANIUM[0] / (1 - TITANIUM[1] ** 2) / 2
    load = 0.5 * flat**2 * modulus / radius
    pair = rounded_pair(12e-3, 6e-3, 0.0, radius, flat / 40, 0.6e-3, flat=flat, quads=quads)
    low = condense(Substructure(pair.lower, Layers(TITANIUM, TITANIUM, "strain")))
    nn, tt = (2 * part for part in low[:2])
    x = pair.lower.x
    weight = pair.lower.tributary_lengths()
    state = press(
        Compliance(Interface(x, weight, 1.0), nn, tt),
        pair.lower.interface_depths + pair.upper.interface_depths,
        load,
    )
    half = rounded_punch_half_width(load, flat, radius / 2, modulus)
    wanted = rounded_punch_pressure(x, load, flat, radius / 2, modulus)
    assert 1.2 * flat < half < 3 * flat
    assert np.abs(state.sigma_n - wanted)[np.abs(x) < 0.95 * half].max() <= 0.01 * wanted.max()
    touching = x[state.sigma_n > 0]
    assert np.ptp(touching) / 2 == pytest.approx(half, rel=0.02)


@pytest.mark.parametrize(
    "change",
    [
        {"radius": 0.5e-3, "flat": 1e-3},
        {"radius": 3e-3},
        {"coating": 1.99e-3},
        {"fine": 3e-4},
        {"flat": 2e-3},
    ],
)
def test_refuses_sizes_that_do_not_fit(change):
    with pytest.raises(PatchfemError, match="rounded edges"):
        rounded_pair(
            **(
                {**SIZES, "radius": 20e-3, "flat": 1e-3}
                | ({"flat": None} if "radius" in change else {})
                | change
            )
        )


def test_refuses_without_gmsh_and_says_what_to_install(tmp_path, monkeypatch):
    sentence = "libGLU.so.1: cannot open shared object file"
    (tmp_path / "gmsh.py").write_text(f"raise OSError({sentence!r})")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "gmsh", raising=False)
    with pytest.raises(Missing, match=r"libGLU.so.1.*install gmsh.*libglu1-mesa"):
        rounded_pair(**SIZES, radius=20e-3, flat=1e-3)
