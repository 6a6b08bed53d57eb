"""Scenes at the edges of what a patch is: tiny loads, thin and stiff layers, spikes, hardly anything touching."""

import json

import numpy as np
import pytest
from command_line import cli
from scene_texts import PIECE

from patchfem import run
from patchfem.closed_forms.contact import hertz_half_width, hertz_peak
from patchfem.core import Outcome, PatchfemError
from patchfem.runs.patch import ladder
from patchfem.runs.patch.grids import predict_condensing_seconds
from patchfem.scene import loads

SIZE, WIDTH, LOAD = 12.7e-3, 12.7e-3, 115.653761996773
MODULUS = 121e9 / (1 - 0.31**2) / 2  # E* of two pieces of the material below
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


def solved(*sets, text=BLOCKS):
    """The Result of a scene, after what must hold in every one: finite numbers, no tension, forces in balance."""
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


def value(result, name) -> float:
    return result.measures[name].value


def holds(result, name, truth) -> bool:
    """Whether the error of a measure covers the truth."""
    measure = result.measures[name]
    return abs(measure.value - truth) <= measure.error


@pytest.fixture
def cheap(monkeypatch):
    """Coarser automatic meshes: a hundredth of the work."""
    monkeypatch.setattr(ladder, "MAX_CONDENSING_SECONDS", {True: 0.1, False: 0.1})


@pytest.mark.share(0)
@pytest.mark.parametrize(("load", "error"), [(1e-3, 2e-2), (1e-6, 3e-2)])
def test_exact_a_sharp_crown_obeys_hertz_at_any_load(load, error, cheap):
    """Radius 1 mm, contact 80 nm and 2.4 nm wide: a and p0 grow with the root of the load."""
    found = solved("contact.crown.radius=1 mm", f"contact.load={load} N", "accuracy.tolerance=1e-2")
    half, peak = (f(load / WIDTH, 1e-3, MODULUS) for f in (hertz_half_width, hertz_peak))
    assert value(found, "pressure_peak") == pytest.approx(peak, rel=error)
    assert value(found, "contact_half_width") == pytest.approx(half, rel=2 * error)
    for name, truth in (
        ("pressure_peak", peak),
        ("contact_half_width", half),
        ("contact_fraction", 2 * half / SIZE),
    ):
        assert holds(found, name, truth), name


@pytest.mark.parametrize("load", [1e-6, 1.0, 30.0])
def test_always_the_error_of_one_touching_node_covers_hertz(load):
    """Cells of 0.2 mm under contacts from 0.7 um to 4 um: nothing is resolved, and the errors say so."""
    found = solved("contact.crown.radius=1 mm", f"contact.load={load} N", COARSE)
    half, peak = (f(load / WIDTH, 1e-3, MODULUS) for f in (hertz_half_width, hertz_peak))
    assert found.patch.active.sum() == 1 and value(found, "normal_load") == pytest.approx(
        load, rel=1e-12
    )
    for name, truth in (
        ("pressure_peak", peak),
        ("contact_half_width", half),
        ("contact_fraction", 2 * half / SIZE),
    ):
        assert holds(found, name, truth), name
    assert any("the tolerance is" in line for line in found.warnings)


@pytest.mark.parametrize(
    "sets", [(TILT,), ("contact.crown.radius=1 m",), (TILT, "contact.crown.radius=2 m")]
)
def test_always_a_load_and_gap_a_billionth_as_large_give_the_same_patch(sets):
    """Linear bodies: load and gap times 1e-9 give pressures and motions times 1e-9 on the same contact set."""
    small = []
    for word in sets:
        name, number = word.split("=")
        number, unit = number.split()
        factor = 1e-9 if "tilt" in name else 1e9
        small.append(f"{name}={float(number) * factor!r} {unit}")
    one = solved(*sets, COARSE)
    other = solved(*small, f"contact.load={LOAD * 1e-9!r} N", COARSE)
    assert np.array_equal(one.patch.active, other.patch.active)
    for name, power in (
        ("pressure_peak", 1),
        ("contact_fraction", 0),
        ("approach", 1),
        ("normal_stiffness", 0),
    ):
        assert value(other, name) == pytest.approx(value(one, name) * 1e-9**power, rel=1e-7), name


def test_exact_a_soft_thin_coating_is_a_bed_of_springs():
    """A bonded layer 1000 times softer, far wider than thick, yields p t/(lambda + 2 mu): under a crown
    p = k (a^2 - x^2)/(2 R), a^3 = 3 P R/(2 k), k of two layers in series; the layers' ends are a/t = 60 away."""
    young = 121e6
    nu = 0.3
    thick = 50e-6
    radius = 1.0
    stiff = young * (1 - nu) / ((1 + nu) * (1 - 2 * nu)) / thick / 2
    half = (3 * LOAD / WIDTH * radius / (2 * stiff)) ** (1 / 3)
    found = solved(
        "contact.crown.radius=1 m",
        "contact.element_size=0.1 mm",
        text=BLOCKS + COATING.format(young, nu, thick),
    )
    assert half / thick > 20 and half < 0.45 * SIZE
    assert value(found, "pressure_peak") == pytest.approx(stiff * half**2 / (2 * radius), rel=0.02)
    assert value(found, "contact_half_width") == pytest.approx(half, abs=0.1e-3)
    assert holds(found, "contact_half_width", half)


def test_exact_a_stiff_coating_carries_a_small_contact_alone(cheap):
    """A layer 1000 times stiffer, 20 half widths thick: Hertz with the layer's own modulus."""
    young = 121e12
    nu = 0.2
    thick = 0.5e-3
    radius = 0.1
    modulus = young / (1 - nu**2) / 2
    line = LOAD / WIDTH
    half = hertz_half_width(line, radius, modulus)
    found = solved(
        "contact.crown.radius=0.1 m",
        "accuracy.tolerance=1e-2",
        text=BLOCKS + COATING.format(young, nu, thick),
    )
    assert thick / half > 20
    assert value(found, "pressure_peak") == pytest.approx(
        hertz_peak(line, radius, modulus), rel=0.01
    )
    assert value(found, "contact_half_width") == pytest.approx(half, rel=0.02)


def test_exact_cells_a_thousand_times_as_long_as_thin_pass_the_patch_test():
    """Without lateral strain flat pieces are bars: approach = 2 p (t/E1 + (H - t)/E2), the same pressure everywhere,
    in cells of 0.5 mm by 0.25 um."""
    text = BLOCKS.replace("0.31", "0.0") + COATING.format(600e9, 0.0, 1e-6)
    found = solved("contact.element_size=0.5 mm", text=text)
    rows = np.diff(found.patch.pair.grid.depth)
    assert np.diff(found.patch.x).max() / rows.min() > 1000
    mean = LOAD / (SIZE * WIDTH)
    assert found.patch.pressure.sigma_n == pytest.approx(
        np.full(found.patch.x.size, mean), rel=1e-8
    )
    assert value(found, "approach") == pytest.approx(
        2 * mean * (1e-6 / 600e9 + (6.35e-3 - 1e-6) / 121e9), rel=1e-8
    )


@pytest.mark.parametrize("share", [0.499, -0.499])
def test_exact_a_load_at_the_edge_of_tipping_is_carried_at_the_edge(share):
    found = solved(f"contact.load_line.offset={share * SIZE} m", COARSE)
    assert value(found, "pressure_centre") == pytest.approx(share * SIZE, rel=1e-9)
    assert np.sign(value(found, "rotation")) == -np.sign(share)
    assert found.patch.active.sum() <= 2


def profile(path, spoil=False) -> list:
    """Settings of a scene with a smooth profile of two waves; spoiled by spikes and by runs of missing heights."""
    x = np.linspace(0, 12.7, 1271)
    z = 2.0 * np.cos(2 * np.pi * x / 6.35) + 0.5 * np.cos(2 * np.pi * x / 3.175)
    cells = [f"{v:.9g}" for v in z]
    if spoil:
        for at, height in ((200, 50), (640, -40), (641, -45), (1100, 30)):
            cells[at] = str(height)
        for first in (100, 500, 900):
            cells[first : first + 12] = ["nan"] * 12
    path.write_text(
        "x [mm],z [um]\n" + "\n".join(f"{a:.9g},{b}" for a, b in zip(x, cells, strict=True)),
        "utf-8",
    )
    return [f"contact.profile.file={path}", "contact.element_size=0.1 mm", "contact.load=1e4 N"]


def test_always_spikes_and_missing_heights_are_counted_and_bridged(tmp_path):
    """A line over 0.12 mm leaves the profile within its own bend, 0.12^2/8 z'' = 7 nm of some 5 um."""
    clean = solved(*profile(tmp_path / "clean.csv"))
    found = solved(*profile(tmp_path / "spoilt.csv", spoil=True))
    said = " ".join(found.warnings)
    assert "4 of 1271 heights are spikes" in said and "36 of 1271" in said
    assert not any("are spikes" in line for line in clean.warnings)
    assert np.abs(found.patch.unloaded_gap - clean.patch.unloaded_gap).max() <= 2e-8
    assert value(found, "pressure_peak") == pytest.approx(value(clean, "pressure_peak"), rel=0.02)
    assert value(found, "contact_fraction") == pytest.approx(
        value(clean, "contact_fraction"), abs=0.02
    )
    assert value(found, "approach") == pytest.approx(value(clean, "approach"), abs=2e-8)


@pytest.mark.share(0)
@pytest.mark.parametrize("mesh", [COARSE, "accuracy.tolerance=1e-2"])
def test_exact_an_approach_that_closes_nothing_carries_nothing(mesh):
    """A crown on a step of -1 um stands 1 um above the flat: 0.9 um of approach leave the pieces apart."""
    text = BLOCKS.replace('load = "26 lbf"\n', "")
    found = solved(
        "contact.step.height=1 um",
        "contact.step.at=-6.3 mm",
        "contact.crown.radius=1 mm",
        "contact.approach.distance=0.9 um",
        mesh,
        text=text,
    )
    assert found.outcome is Outcome.NO_CONTACT and not found.patch.active.any()
    assert all(
        value(found, name) == 0 for name in ("normal_load", "contact_fraction", "pressure_peak")
    )
    assert found.patch.pressure.gap.min() == pytest.approx(0.1e-6, rel=1e-6)
    assert Outcome.NO_CONTACT.sentence in found.warnings


EXPONENTIAL = "contact.asperities.law=exponential"


def test_exact_strips_across_a_step_that_bears_are_the_whole_patch_and_its_peak_has_no_bound():
    """Level strips are pressed alike, so that their number changes nothing; nothing bounds the peak at the step."""
    step = ("contact.step.height=1 um", "contact.step.at=2 mm")
    found = solved("contact.strips.count=4", *step, COARSE)
    alone = solved(*step, COARSE)
    for name in ("pressure_peak", "loaded_fraction"):
        assert value(found, name) is None
        assert found.measures[name].reason == alone.measures[name].reason
    for name in ("approach", "contact_fraction", "normal_stiffness"):
        assert value(found, name) == pytest.approx(value(alone, name), rel=1e-9)


GRADED = {
    "corner": ("contact.tilt.angle=10 mrad",), "step": ("contact.step.height=1 um", "contact.step.at=2 mm"),
    "full": (), "no load": ("contact.load=0 N",), "billionth": ("contact.load=1e-7 N", TILT),
    "strips": (TILT, "contact.strips.count=5", "contact.strips.roll=0.1 mrad"),
    "smooth skin": (TILT, EXPONENTIAL, "contact.asperities.decay_length=1 um"),
    "thin skin": (TILT, EXPONENTIAL, "contact.asperities.decay_length=1 nm"),
    "flat": ("contact.height=0.127 mm", TILT), "tall": ("contact.height=127 mm", TILT),
    "unlike": (TILT, "contact.upper.height=3 mm"), "tipping": ("contact.load_line.offset=6.337 mm",),
    "held": ("contact.crown.radius=1 m", "contact.holder.rotational_stiffness=1e3 N m/rad",
             "contact.load_line.offset=3 mm"),
}  # fmt: skip
COATED = {"thin coating": 1e-6, "thick coating": 6.2865e-3}


@pytest.mark.share(0, 1, 2, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14)
@pytest.mark.parametrize("name", [*GRADED, *COATED])
def test_always_an_automatic_mesh_is_found_and_stays_small(name, cheap):
    text = BLOCKS + COATING.format(250e9, 0.24, COATED[name]) if name in COATED else BLOCKS
    found = solved(*GRADED.get(name, (TILT,)), "accuracy.tolerance=1e-2", text=text)
    grids = {id(g): g for g in (found.patch.pair.grid, found.patch.pair.upper_grid)}.values()
    assert predict_condensing_seconds(grids) <= 0.15 and np.diff(found.patch.x).min() > 0
    if name in ("corner", "billionth"):  # the contact lies at the corner that the wedge closes
        assert value(found, "pressure_centre") == pytest.approx(-SIZE / 2, rel=5e-3)


def test_always_the_command_line_names_what_was_wrong(tmp_path):
    """Exit 3 with numbers throughout where a pinned mesh is too coarse, 2 for mistakes; never a traceback."""
    path = tmp_path / "hard.toml"
    path.write_text(BLOCKS + '[contact.crown]\nradius = "1 mm"\n', "utf-8")
    code, out, err = cli("run", path, "-o", tmp_path / "out", "--set", COARSE, "--json")
    assert code == 3 and "NaN" not in out and "Infinity" not in out and "Traceback" not in err
    assert all(np.isfinite(m["value"]) for m in json.loads(out)["measures"].values())
    assert json.loads(out)["contact"]["stretches"] == [[0.0, 0.0]]  # one node bears all
    assert ", at x = 0 mm; peak" in cli("run", path, "-o", tmp_path / "out", "--set", COARSE).out
    for sets, exit_code, said in (
        (f"contact.load_line.offset={SIZE / 2} m", 2, "contact.load_line.offset"),
        ("contact.load=-1 N", 2, "contact.load"),
        ("contact.profile.file=none.csv", 2, "none.csv"),
    ):
        code, _, err = cli("run", path, "-o", tmp_path / "out2", "--set", COARSE, "--set", sets)
        assert code == exit_code and said in err and "Traceback" not in err, (sets, code, err)


def test_refuses_a_profile_without_heights(tmp_path):
    path = tmp_path / "lost.csv"
    path.write_text(
        "x [mm],z [um]\n" + "\n".join(f"{a},nan" for a in np.linspace(0, 12.7, 50)), "utf-8"
    )
    with pytest.raises(PatchfemError, match=r"lost\.csv"):
        solved(f"contact.profile.file={path}", COARSE)
