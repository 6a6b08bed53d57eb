"""Extreme patches: tiny loads, thin and stiff coatings, spikes in profiles, and contact at a few
nodes."""

import numpy as np
import pytest
from scene_texts import PIECE

from patchfem import run
from patchfem.closed_forms.contact import hertz_half_width, hertz_peak
from patchfem.core import Outcome, PatchfemError
from patchfem.runs.patch import mesh_levels
from patchfem.runs.patch.grids import predict_condensing_seconds
from patchfem.scene import loads

SIZE, WIDTH, LOAD = 12.7e-3, 12.7e-3, 115.653761996773
MODULUS = 121e9 / (1 - 0.31**2) / 2  # Combined modulus E* [Pa] of two pieces of the material below.
BLOCKS = (
    PIECE
    + """\
load = "26 lbf"
substrate = {young = "121 GPa", poisson = 0.31, density = "4370 kg/m^3"}
"""
)
COATING = (
    '[contact.coating]\nmaterial = {{young = "{} Pa", poisson = {}, density = "9000 kg/m^3"}}\n'
    'thickness = "{} m"\n'
)
COARSE = "contact.element_size=0.2 mm"
TILT = "contact.tilt.angle=0.1 mrad"


def run_and_check(*sets, text=BLOCKS):
    """Return the result of a scene after checks that hold for every scene: finite numbers, no
    tension, balanced forces."""
    scene = loads(text, "hard.toml", sets)
    result = run(scene)
    patch = result.patch
    for name, measure in result.measures.items():
        if measure.value is None:
            assert measure.reason, name
            continue
        assert np.isfinite(measure.value) and measure.error >= 0 and np.isfinite(measure.error), (
            name
        )
    for field in result.fields.values():
        assert np.isfinite(field).all()
    assert patch.pressure.sigma_n.min() >= 0 and all(
        v <= 1e-9 for v in patch.pressure.residuals.values()
    )
    if result.outcome is Outcome.DONE and scene.contact.load is not None:
        assert patch.pressure.sigma_n @ patch.pieces.interface.weight == pytest.approx(
            scene.contact.load, rel=1e-9
        )
    return result


def measure_value(result, name) -> float:
    """Return the value of a measure."""
    return result.measures[name].value


def error_covers(result, name, reference) -> bool:
    """Return whether the error of a measure covers a reference value."""
    measure = result.measures[name]
    return abs(measure.value - reference) <= measure.error


@pytest.fixture
def coarse_meshes(monkeypatch):
    """Limit automatic meshes to a hundredth of the usual cost."""
    monkeypatch.setattr(mesh_levels, "MAX_CONDENSING_SECONDS", {True: 0.1, False: 0.1})


@pytest.mark.share(0)
@pytest.mark.parametrize(("load", "error"), [(1e-3, 2e-2), (1e-6, 3e-2)])
def test_exact_sharp_crown_agrees_with_hertz(load, error, coarse_meshes):
    """A crown of radius 1 mm agrees with Hertz theory for contacts of 80 nm and of 2.4 nm."""
    result = run_and_check(
        "contact.crown.radius=1 mm", f"contact.load={load} N", "accuracy.tolerance=1e-2"
    )
    half, peak = (f(load / WIDTH, 1e-3, MODULUS) for f in (hertz_half_width, hertz_peak))
    assert measure_value(result, "pressure_peak") == pytest.approx(peak, rel=error)
    assert measure_value(result, "contact_half_width") == pytest.approx(half, rel=2 * error)
    for name, reference in (
        ("pressure_peak", peak),
        ("contact_half_width", half),
        ("contact_fraction", 2 * half / SIZE),
    ):
        assert error_covers(result, name, reference), name


@pytest.mark.parametrize("load", [1e-6, 30.0])
def test_always_errors_of_single_node_contact_cover_hertz(load):
    """Elements of 0.2 mm cannot resolve contacts of 0.7 um to 4 um; the errors cover the difference
    from Hertz theory."""
    result = run_and_check("contact.crown.radius=1 mm", f"contact.load={load} N", COARSE)
    half, peak = (f(load / WIDTH, 1e-3, MODULUS) for f in (hertz_half_width, hertz_peak))
    assert result.patch.active.sum() == 1 and measure_value(result, "normal_load") == pytest.approx(
        load, rel=1e-12
    )
    for name, reference in (
        ("pressure_peak", peak),
        ("contact_half_width", half),
        ("contact_fraction", 2 * half / SIZE),
    ):
        assert error_covers(result, name, reference), name
    assert any("the tolerance is" in line for line in result.warnings)


@pytest.mark.parametrize("sets", [(TILT,), (TILT, "contact.crown.radius=2 m")])
def test_always_patch_scales_linearly_with_load_and_gap(sets):
    """Load and gap times 1e-9 give pressures and displacements times 1e-9 on the same contact
    nodes."""
    scaled_keys = []
    for assignment in sets:
        name, number = assignment.split("=")
        number, unit = number.split()
        factor = 1e-9 if "tilt" in name else 1e9
        scaled_keys.append(f"{name}={float(number) * factor!r} {unit}")
    full = run_and_check(*sets, COARSE)
    scaled = run_and_check(*scaled_keys, f"contact.load={LOAD * 1e-9!r} N", COARSE)
    assert np.array_equal(full.patch.active, scaled.patch.active)
    for name, power in (
        ("pressure_peak", 1),
        ("contact_fraction", 0),
        ("approach", 1),
        ("normal_stiffness", 0),
    ):
        assert measure_value(scaled, name) == pytest.approx(
            measure_value(full, name) * 1e-9**power, rel=1e-7
        ), name


def test_exact_soft_thin_coating_agrees_with_winkler_foundation():
    """A thin bonded coating 1000 times softer than the pieces acts as a Winkler foundation of
    stiffness k = (lambda + 2 mu)/t, with both coatings in series.

    Under a crown p = k (a^2 - x^2)/(2 R) and a^3 = 3 P R/(2 k); the contact is 60 times wider than
    the coating is thick.
    """
    young = 121e6
    nu = 0.3
    thick = 50e-6
    radius = 1.0
    foundation_stiffness = young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / thick / 2
    half = (3 * LOAD / WIDTH * radius / (2 * foundation_stiffness)) ** (1 / 3)
    result = run_and_check(
        "contact.crown.radius=1 m",
        "contact.element_size=0.1 mm",
        text=BLOCKS + COATING.format(young, nu, thick),
    )
    assert half / thick > 20 and half < 0.45 * SIZE
    assert measure_value(result, "pressure_peak") == pytest.approx(
        foundation_stiffness * half**2 / (2 * radius), rel=0.02
    )
    assert measure_value(result, "contact_half_width") == pytest.approx(half, abs=0.1e-3)
    assert error_covers(result, "contact_half_width", half)


def test_exact_stiff_thick_coating_agrees_with_hertz(coarse_meshes):
    """A contact on a coating 1000 times stiffer and 20 half-widths thick agrees with Hertz theory
    for the modulus of the coating."""
    young = 121e12
    nu = 0.2
    thick = 0.5e-3
    radius = 0.1
    modulus = young / (1 - nu**2) / 2
    line = LOAD / WIDTH
    half = hertz_half_width(line, radius, modulus)
    result = run_and_check(
        "contact.crown.radius=0.1 m",
        "accuracy.tolerance=1e-2",
        text=BLOCKS + COATING.format(young, nu, thick),
    )
    assert thick / half > 20
    assert measure_value(result, "pressure_peak") == pytest.approx(
        hertz_peak(line, radius, modulus), rel=0.01
    )
    assert measure_value(result, "contact_half_width") == pytest.approx(half, rel=0.02)


def test_exact_patch_test_with_elongated_elements():
    """With a Poisson ratio of 0, flat pieces act as bars: the approach is 2 p (t/E1 + (H - t)/E2)
    and the pressure is uniform, with elements of 0.5 mm by 0.25 um."""
    text = BLOCKS.replace("0.31", "0.0") + COATING.format(600e9, 0.0, 1e-6)
    result = run_and_check("contact.element_size=0.5 mm", text=text)
    rows = np.diff(result.patch.pair.grid.depth)
    assert np.diff(result.patch.x).max() / rows.min() > 1000
    mean = LOAD / (SIZE * WIDTH)
    assert result.patch.pressure.sigma_n == pytest.approx(
        np.full(result.patch.x.size, mean), rel=1e-8
    )
    assert measure_value(result, "approach") == pytest.approx(
        2 * mean * (1e-6 / 600e9 + (6.35e-3 - 1e-6) / 121e9), rel=1e-8
    )


def test_exact_load_near_edge_is_carried_at_edge():
    """A load close to an edge is carried by at most two nodes at this edge, and the piece rotates towards it."""
    result = run_and_check(f"contact.load_line.offset={-0.499 * SIZE} m", COARSE)
    assert measure_value(result, "pressure_centre") == pytest.approx(-0.499 * SIZE, rel=1e-9)
    assert measure_value(result, "rotation") > 0
    assert result.patch.active.sum() <= 2


@pytest.mark.share(0)
@pytest.mark.parametrize("mesh", [COARSE, "accuracy.tolerance=1e-2"])
def test_exact_approach_below_first_contact_has_no_load(mesh):
    """A crown at a step of -1 um lies 1 um above the flat piece; an approach of 0.9 um leaves a gap
    of 0.1 um and no load."""
    text = BLOCKS.replace('load = "26 lbf"\n', "")
    result = run_and_check(
        "contact.step.height=1 um",
        "contact.step.at=-6.3 mm",
        "contact.crown.radius=1 mm",
        "contact.approach.distance=0.9 um",
        mesh,
        text=text,
    )
    assert result.outcome is Outcome.NO_CONTACT and not result.patch.active.any()
    assert all(
        measure_value(result, name) == 0
        for name in ("normal_load", "contact_fraction", "pressure_peak")
    )
    assert result.patch.pressure.gap.min() == pytest.approx(0.1e-6, rel=1e-6)
    assert Outcome.NO_CONTACT.sentence in result.warnings


EXPONENTIAL = "contact.asperities.law=exponential"


SCENE_SETTINGS = {
    "corner": ("contact.tilt.angle=10 mrad",), "no load": ("contact.load=0 N",), "billionth": ("contact.load=1e-7 N", TILT),
    "strips": (TILT, "contact.strips.count=5", "contact.strips.roll=0.1 mrad"),
    "thin skin": (TILT, EXPONENTIAL, "contact.asperities.decay_length=1 nm"),
    "flat": ("contact.height=0.127 mm", TILT), "tipping": ("contact.load_line.offset=6.337 mm",),
    "held": ("contact.crown.radius=1 m", "contact.holder.rotational_stiffness=1e3 N m/rad",
             "contact.load_line.offset=3 mm"),
}  # fmt: skip
COATING_THICKNESS = {"thin coating": 1e-6}


@pytest.mark.parametrize("name", [*SCENE_SETTINGS, *COATING_THICKNESS])
def test_always_automatic_mesh_stays_within_cost(name, coarse_meshes):
    """Automatic meshes of extreme patches stay within the limit of the cost."""
    text = (
        BLOCKS + COATING.format(250e9, 0.24, COATING_THICKNESS[name])
        if name in COATING_THICKNESS
        else BLOCKS
    )
    result = run_and_check(*SCENE_SETTINGS.get(name, (TILT,)), "accuracy.tolerance=1e-2", text=text)
    grids = {id(g): g for g in (result.patch.pair.grid, result.patch.pair.upper_grid)}.values()
    assert predict_condensing_seconds(grids) <= 0.4 and np.diff(result.patch.x).min() > 0
    if name in ("corner", "billionth"):  # The contact lies at the corner where the wedge closes.
        assert measure_value(result, "pressure_centre") == pytest.approx(-SIZE / 2, rel=5e-3)


def test_refuses_profile_without_heights(tmp_path):
    """A profile whose heights are all missing is refused with its file name."""
    path = tmp_path / "lost.csv"
    path.write_text(
        "x [mm],z [um]\n" + "\n".join(f"{a},nan" for a in np.linspace(0, 12.7, 50)), "utf-8"
    )
    with pytest.raises(PatchfemError, match=r"lost\.csv"):
        run_and_check(f"contact.profile.file={path}", COARSE)
