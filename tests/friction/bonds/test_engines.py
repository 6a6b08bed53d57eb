"""The choice of the engine, and the engines in the compiled loop: forces, energy created, marches, scene key."""

from typing import get_args

import numpy as np
import pytest
from friction_paths import pulled, random_walk, triangle, upper_pressure
from march_paths import OMEGA, follow, one_mode
from scene_texts import DRIVE, KILOGRAM

from patchfem import build, plan
from patchfem.core import SineDrive
from patchfem.dynamics import bond_list_model, points_model
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, Quadrature, RequestedEngine, choose_engine, unsupported_reason
from patchfem.friction.bonds.engines import ENGINES
from patchfem.response import energy_balance
from patchfem.runs import choose_numerics as settings_of
from patchfem.runs.rig.interface import make_single_contact
from patchfem.runs.rig.lists import choose_bond_summation
from patchfem.runs.rig.motion_warnings import warn_of_created_energy
from patchfem.scene import scene
from patchfem.scene.keys.tables import Accuracy

TEXT = (
    """title = "one mass"
[normal]
load = "98.0665 N"
[friction]
law = "nonlocal"
static = 0.4
reading = "{reading}"
order = {order}
bond_length = "1 um"
initial_bonds = 0.0
{growth}
"""
    + KILOGRAM
    + DRIVE.replace("cycles = 30", "cycles = 3")
    + """\
[accuracy]
quadrature = "{engine}"
"""
)


def rig(tmp_path, engine="auto", reading="report", order=1, growth=""):
    file = tmp_path / "rig.toml"
    file.write_text(TEXT.format(engine=engine, reading=reading, order=order, growth=growth))
    return scene.load(file)


# ---- choice


def test_exact_choice_where_a_recursion_is_exact():
    got = choose_engine(Bonds(1.0, 1.0), 1e-3, 10.0, 200)
    assert (got.engine, got.error, got.strips) == ("recursion", 0.0, 0.0)


@pytest.mark.parametrize(
    "stroke, steps, want", [(10.0, 20, "truncated"), (0.1, 200, "merged"), (2.0, 1000, "merged")]
)
def test_exact_choice_follows_the_cost(stroke, steps, want):
    """Order 2: few live strips are cut off only; many are merged."""
    got = choose_engine(Bonds(1.0, 1.0, 2.0), 1e-3, stroke, steps)
    assert got.engine == want and got.error <= 1e-4
    other = choose_engine(
        Bonds(1.0, 1.0, 2.0),
        1e-3,
        stroke,
        steps,
        RequestedEngine({"merged": "truncated", "truncated": "merged"}[want]),
    )
    assert got.seconds <= other.seconds


def test_always_tighter_tolerances_tighten_the_engine():
    found = [
        choose_engine(Bonds(1.0, 1.0, 0.5), tolerance, 1.0, 500, RequestedEngine("merged"))
        for tolerance in (1e-2, 1e-3, 1e-4)
    ]
    assert (
        found[0].merge >= found[1].merge > found[2].merge
        and found[0].tail >= found[1].tail > found[2].tail
    )
    assert all(
        choice.error <= 0.1 * tolerance * 1.01
        for choice, tolerance in zip(found, (1e-2, 1e-3, 1e-4))
    )
    pinned = choose_engine(
        Bonds(1.0, 1.0, 0.5), 1e-3, 1.0, 500, RequestedEngine("merged", 1e-4, 0.1)
    )
    assert (pinned.tail, pinned.merge) == (1e-4, 0.1)


def test_refuses_a_recursion_of_any_other_law():
    for reading, order in (("report", 1.0), ("stretch", 2.0)):
        with pytest.raises(ValueError, match="order = 1"):
            choose_engine(
                Bonds(1.0, 1.0, order, reading), 1e-3, 1.0, 100, RequestedEngine("recursion")
            )
        assert unsupported_reason("recursion", reading, order) and not unsupported_reason(
            "merged", reading, order
        )
    # what a scene may name
    assert get_args(Accuracy.model_fields["quadrature"].annotation) == (
        "auto",
        *ENGINES,
    )


# ---- the loop along a given slide


def test_exact_reading_report_creates_energy_in_the_loop():
    """p = 1 as printed, 20 triangle cycles of A = 0.01 from rest: W/(4 A n) = -3.9761e-4; stretch: +2.1858e-5.

    The book of the loop closes: work = dissipated - created + stored.
    """
    path = triangle(0.01, 20, 40)[:-20]
    assert path[0] == path[-1] == 0
    for reading, want in (("report", -3.9761e-4), ("stretch", 2.1858e-5)):
        law = Bonds(1.0, 1.0, 1.0, reading, initial=0.0)
        forces, energies, bad, contact = follow(bond_list_model(law, 1.0, np.inf, 0.0), path, 1.0)
        work = forces[:-1, 1] @ np.diff(path)
        assert bad == 0 and work / (4 * 0.01 * 20) == pytest.approx(want, rel=1e-3)
        created, dissipated = contact.status[6:8]
        assert work == pytest.approx(dissipated - created + energies[-1, 1], abs=1e-15)
        assert (created > 1e-4) == (reading == "report") and (created == 0) == (
            reading == "stretch"
        )


@pytest.mark.parametrize(
    "order, initial, size",
    [
        (0.0, 0.0, 0.2),
        (0.5, 0.0, 0.2),
        (2.0, 0.0, 0.2),
        (3.0, 0.0, 0.2),
        (0.0, 1.0, 0.1),
        (0.0, 1.0, 0.01),
        (0.5, 1.0, 0.004),
    ],
)
def test_always_the_stretch_reading_creates_next_to_nothing(order, initial, size):
    """Orders p >= 0 never create energy. The path mean of the force by Simpson's rule or Gauss points created up to 5 %
    of the work in the last rows, where the force jumps or has a cusp inside a step; the mean from the energy none."""
    path = random_walk(8, 400, size)
    _, _, bad, contact = follow(
        bond_list_model(Bonds(1.0, 1.0, order, initial=initial), 1.0, np.inf, 0.0), path, 1.0
    )
    assert bad == 0 and contact.status[6] <= 1e-7 * contact.status[7]


# ---- marches


@pytest.mark.parametrize(
    "reading, order", [("report", -0.5), ("report", 0.0), ("report", 1.0), ("stretch", 0.5)]
)
def test_exact_march_of_a_list_replayed_by_the_numpy_law(reading, order):
    """The marched slide walked again by the NumPy sum gives the marched forces; the energy book closes."""
    law = Bonds(0.4, 2e-6, order, reading, initial=0.0)
    limit = 0.4 * 98.0665
    got = march(
        one_mode(OMEGA, 0.01, 1.0),
        SineDrive(5 * 9.80665, OMEGA),
        bond_list_model(law, limit, np.inf, 0.0),
        2,
        100,
        window=2,
    )
    run = pulled(Quadrature(law, tail=0.0), got.window.slide, upper_pressure([98.0665]), 1 / 14300)
    book = got.ledger
    assert got.outcome is None and np.ptp(got.window.slide) > 5e-6
    assert got.window.force[1:] == pytest.approx(run.traction[:, 0], abs=2e-4 * limit)
    assert energy_balance(book) <= 1e-8
    assert book["friction"] == pytest.approx(book["dissipated"] - book["created"], rel=1e-9)


def test_exact_march_of_direct_stretch_is_the_recursion():
    law = Bonds(0.4, 2e-6)
    limit = 0.4 * 98.0665
    runs = [
        march(
            one_mode(OMEGA, 0.003, 1.0), SineDrive(5 * 9.80665, OMEGA), model, 3, 100, window=2
        ).window
        for model in (
            bond_list_model(law, limit, np.inf, 0.0),
            points_model(law, [1e-4], [98.0665e4]),
        )
    ]
    assert runs[0].slide == pytest.approx(runs[1].slide, abs=1e-10 * np.ptp(runs[1].slide))
    assert runs[0].force == pytest.approx(runs[1].force, abs=1e-10 * limit)


# ---- scene key


def test_exact_engine_of_a_scene(tmp_path):
    for engine, order, reading, kind in (
        ("auto", 1, "stretch", "element"),
        ("direct", 1, "stretch", "list"),
        ("merged", 2, "stretch", "list"),
        ("truncated", 0, "report", "list"),
        ("recursion", 1, "stretch", "element"),
    ):
        found = build(rig(tmp_path, engine, reading, order))
        numerics = settings_of(found)
        assert (
            make_single_contact(found, numerics, None).contact
            == f"dynamics.interfaces.{kind}_kernels"
        )
        used = choose_bond_summation(found, numerics).engine
        assert used == engine or engine == "auto"
        assert any(f"method of the sum over bonds: {used}" in line for line in plan(found).verdict)


def test_refuses_engines_that_cannot_sum_the_law(tmp_path):
    with pytest.raises(scene.SceneError, match=r"accuracy\.quadrature.*order = 1"):
        rig(tmp_path, "recursion")


def test_exact_warning_of_energy_created(tmp_path):
    found = build(rig(tmp_path))
    assert warn_of_created_energy(found, {"created": 2e-6, "dissipated": 1e-3}, 4) == [
        "the law as printed in the report created 5e-07 J per cycle, 0.2 % of the energy that it dissipated; "
        'with friction.reading = "stretch" no energy is created'
    ]
    assert warn_of_created_energy(found, {"created": 0.0, "dissipated": 1e-3}, 4) == []
    assert (
        warn_of_created_energy(
            build(rig(tmp_path, reading="stretch")), {"created": 1.0, "dissipated": 1.0}, 4
        )
        == []
    )
