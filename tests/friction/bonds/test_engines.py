"""Choice of the engine that sums the bonds, and the engines in the compiled time loop."""

import numpy as np
import pytest
from friction_paths import (
    make_points,
    triangle_path,
    upper_pressure,
)
from march_paths import follow_path
from scene_texts import DRIVE, KILOGRAM

from patchfem import build
from patchfem.friction import Bonds
from patchfem.runs import choose_numerics as settings_of
from patchfem.runs.interfaces.bond_lists import choose_bond_summation
from patchfem.runs.interfaces.contact_points import make_contact
from patchfem.scene import scene

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
"""
    + KILOGRAM
    + DRIVE.replace("cycles = 30", "cycles = 3")
    + """\
[accuracy]
quadrature = "{engine}"
"""
)


def load_rig_scene(tmp_path, engine="auto", reading="report", order=1):
    """Return the loaded scene of a rig with a bond law."""
    file = tmp_path / "rig.toml"
    file.write_text(TEXT.format(engine=engine, reading=reading, order=order))
    return scene.load(file)


# ---- lists along a prescribed path


def test_printed_law_creates_energy_per_cycle():
    """The work per cycle agrees with its known value, and only the printed form of the law creates energy.

    Work equals dissipated energy, less the created energy, plus stored energy.
    """
    path = triangle_path(0.01, 20, 40)[:-20]
    assert path[0] == path[-1] == 0
    for reading, expected in (("report", -3.9761e-4), ("stretch", 2.1858e-5)):
        law = Bonds(1.0, 1.0, 1.0, reading, initial=0.0)
        forces, energies, n_unsolved, _ = follow_path(
            make_points(law, upper_pressure([1.0]), 0.0), path, 1.0
        )
        work = forces[:-1, 1] @ np.diff(path)
        assert n_unsolved == 0 and work / (4 * 0.01 * 20) == pytest.approx(expected, rel=1e-3)
        losses = energies[:-1, 0]
        assert work == pytest.approx(losses.sum() + energies[-1, 1], abs=1e-15)
        created = -losses[losses < 0].sum()
        assert (created > 1e-4) == (reading == "report")
        assert (created < 1e-15) == (reading == "stretch")


def test_exact_scene_key_selects_engine(tmp_path):
    """The key `accuracy.quadrature` selects the engine."""
    for engine, order, reading, has_list in (
        ("auto", 1, "stretch", False),
        ("direct", 1, "stretch", True),
        ("merged", 2, "stretch", True),
        ("truncated", 0, "report", True),
        ("recursion", 1, "stretch", False),
    ):
        model = build(load_rig_scene(tmp_path, engine, reading, order))
        numerics = settings_of(model)
        contact = make_contact(model, numerics, None)
        assert contact.has_lists == has_list
        engine_used = choose_bond_summation(model, numerics).engine
        assert engine_used == engine or engine == "auto"


def test_unsuitable_engine_is_not_used(tmp_path):
    """A scene that requests the recursion for a law of another form has a remark and the sum of its law."""
    loaded = load_rig_scene(tmp_path, "recursion")
    (remark,) = loaded.remarks
    assert remark == (
        "accuracy.quadrature is not used, because a recursion needs reading 'stretch' and order 1"
    )
    model = build(loaded)
    assert choose_bond_summation(model, settings_of(model)).engine != "recursion"
