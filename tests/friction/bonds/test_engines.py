"""Choice of the engine that sums the bonds, and the engines in the compiled time loop."""

from typing import get_args

import numpy as np
import pytest
from friction_paths import march_tractions, random_walk, triangle_path, upper_pressure
from march_paths import OMEGA, follow_path, make_one_mode
from scene_texts import DRIVE, KILOGRAM

from patchfem import build, plan
from patchfem.core import SineDrive
from patchfem.dynamics import bond_list_model, points_model
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, Quadrature, RequestedEngine, choose_engine, unsupported_reason
from patchfem.friction.bonds.engines import ENGINES
from patchfem.response import energy_balance
from patchfem.runs import choose_numerics as settings_of
from patchfem.runs.rig.bond_lists import choose_bond_summation
from patchfem.runs.rig.interface import make_single_contact
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


def load_rig_scene(tmp_path, engine="auto", reading="report", order=1, growth=""):
    """Return the loaded scene of a rig with a bond law."""
    file = tmp_path / "rig.toml"
    file.write_text(TEXT.format(engine=engine, reading=reading, order=order, growth=growth))
    return scene.load(file)


# ---- choice of the engine


def test_exact_recursion_is_chosen_where_exact():
    """The default law is summed by the recursion, whose stated error is zero."""
    choice = choose_engine(Bonds(1.0, 1.0), 1e-3, 10.0, 200)
    assert (choice.engine, choice.error, choice.strips) == ("recursion", 0.0, 0.0)


@pytest.mark.parametrize(
    "stroke, steps, expected",
    [(10.0, 20, "truncated"), (0.1, 200, "merged"), (2.0, 1000, "merged")],
)
def test_exact_cheaper_engine_is_chosen(stroke, steps, expected):
    """Truncation is chosen for few live strips and merging for many; the choice is never slower than the other engine."""
    choice = choose_engine(Bonds(1.0, 1.0, 2.0), 1e-3, stroke, steps)
    assert choice.engine == expected and choice.error <= 1e-4
    other = choose_engine(
        Bonds(1.0, 1.0, 2.0),
        1e-3,
        stroke,
        steps,
        RequestedEngine({"merged": "truncated", "truncated": "merged"}[expected]),
    )
    assert choice.seconds <= other.seconds


def test_always_engine_error_follows_tolerance():
    """A smaller tolerance gives a smaller tail and merge width, and the stated error stays below a tenth of it."""
    choices = [
        choose_engine(Bonds(1.0, 1.0, 0.5), tolerance, 1.0, 500, RequestedEngine("merged"))
        for tolerance in (1e-2, 1e-3, 1e-4)
    ]
    assert (
        choices[0].merge >= choices[1].merge > choices[2].merge
        and choices[0].tail >= choices[1].tail > choices[2].tail
    )
    assert all(
        choice.error <= 0.1 * tolerance * 1.01
        for choice, tolerance in zip(choices, (1e-2, 1e-3, 1e-4))
    )
    fixed_choice = choose_engine(
        Bonds(1.0, 1.0, 0.5), 1e-3, 1.0, 500, RequestedEngine("merged", 1e-4, 0.1)
    )
    assert (fixed_choice.tail, fixed_choice.merge) == (1e-4, 0.1)


def test_refuses_recursion_for_unsupported_law():
    """A requested recursion is refused unless the law is the stretch form of order one."""
    for reading, order in (("report", 1.0), ("stretch", 2.0)):
        with pytest.raises(ValueError, match="order = 1"):
            choose_engine(
                Bonds(1.0, 1.0, order, reading), 1e-3, 1.0, 100, RequestedEngine("recursion")
            )
        assert unsupported_reason("recursion", reading, order) and not unsupported_reason(
            "merged", reading, order
        )
    # the scene key accepts these engines
    assert get_args(Accuracy.model_fields["quadrature"].annotation) == (
        "auto",
        *ENGINES,
    )


# ---- the compiled loop along a prescribed path


def test_exact_printed_law_creates_energy_per_cycle():
    """The work per cycle agrees with its known value, and only the printed form of the law creates energy.

    Work equals dissipated energy, less the created energy, plus stored energy.
    """
    path = triangle_path(0.01, 20, 40)[:-20]
    assert path[0] == path[-1] == 0
    for reading, expected in (("report", -3.9761e-4), ("stretch", 2.1858e-5)):
        law = Bonds(1.0, 1.0, 1.0, reading, initial=0.0)
        forces, energies, n_failures, contact = follow_path(
            bond_list_model(law, 1.0, np.inf, 0.0), path, 1.0
        )
        work = forces[:-1, 1] @ np.diff(path)
        assert n_failures == 0 and work / (4 * 0.01 * 20) == pytest.approx(expected, rel=1e-3)
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
def test_always_stretch_law_creates_negligible_energy(order, initial, size):
    """The stretch form of the law creates at most 1e-7 of the energy that it dissipates.

    With Simpson's rule or Gauss points for the mean force of a step, the last rows created up to 5
    % of the work, because the force jumps or has a cusp inside the step.
    """
    path = random_walk(8, 400, size)
    _, _, n_failures, contact = follow_path(
        bond_list_model(Bonds(1.0, 1.0, order, initial=initial), 1.0, np.inf, 0.0), path, 1.0
    )
    assert n_failures == 0 and contact.status[6] <= 1e-7 * contact.status[7]


# ---- marches


@pytest.mark.parametrize(
    "reading, order", [("report", -0.5), ("report", 0.0), ("report", 1.0), ("stretch", 0.5)]
)
def test_exact_marched_list_agrees_with_numpy_sum(reading, order):
    """The NumPy sum along the marched relative displacement gives the marched forces, and the energy balance closes."""
    law = Bonds(0.4, 2e-6, order, reading, initial=0.0)
    limit = 0.4 * 98.0665
    marched = march(
        make_one_mode(OMEGA, 0.01, 1.0),
        SineDrive(5 * 9.80665, OMEGA),
        bond_list_model(law, limit, np.inf, 0.0),
        2,
        100,
        window=2,
    )
    replay = march_tractions(
        Quadrature(law, tail=0.0), marched.window.slide, upper_pressure([98.0665]), 1 / 14300
    )
    ledger = marched.ledger
    assert marched.outcome is None and np.ptp(marched.window.slide) > 5e-6
    assert marched.window.force[1:] == pytest.approx(replay.traction[:, 0], abs=2e-4 * limit)
    assert energy_balance(ledger) <= 1e-8
    assert ledger["friction"] == pytest.approx(ledger["dissipated"] - ledger["created"], rel=1e-9)


def test_exact_direct_march_equals_recursion_march():
    """A march with every bond in a list equals the march with the recursion within 1e-10."""
    law = Bonds(0.4, 2e-6)
    limit = 0.4 * 98.0665
    runs = [
        march(
            make_one_mode(OMEGA, 0.003, 1.0), SineDrive(5 * 9.80665, OMEGA), model, 3, 100, window=2
        ).window
        for model in (
            bond_list_model(law, limit, np.inf, 0.0),
            points_model(law, [1e-4], [98.0665e4]),
        )
    ]
    assert runs[0].slide == pytest.approx(runs[1].slide, abs=1e-10 * np.ptp(runs[1].slide))
    assert runs[0].force == pytest.approx(runs[1].force, abs=1e-10 * limit)


# ---- scene key


def test_exact_scene_key_selects_engine(tmp_path):
    """The key `accuracy.quadrature` selects the engine, and the plan states it."""
    for engine, order, reading, kind in (
        ("auto", 1, "stretch", "element"),
        ("direct", 1, "stretch", "list"),
        ("merged", 2, "stretch", "list"),
        ("truncated", 0, "report", "list"),
        ("recursion", 1, "stretch", "element"),
    ):
        model = build(load_rig_scene(tmp_path, engine, reading, order))
        numerics = settings_of(model)
        assert (
            make_single_contact(model, numerics, None).contact
            == f"dynamics.interfaces.{kind}_kernels"
        )
        engine_used = choose_bond_summation(model, numerics).engine
        assert engine_used == engine or engine == "auto"
        assert any(
            f"method of the sum over bonds: {engine_used}" in line for line in plan(model).verdict
        )


def test_refuses_scene_with_unsuitable_engine(tmp_path):
    """A scene that requests the recursion for a law of another form is refused."""
    with pytest.raises(scene.SceneError, match=r"accuracy\.quadrature.*order = 1"):
        load_rig_scene(tmp_path, "recursion")


def test_exact_warning_states_created_energy(tmp_path):
    """The warning states the energy created per cycle by the printed law, and is absent if none is created."""
    model = build(load_rig_scene(tmp_path))
    assert warn_of_created_energy(model, {"created": 2e-6, "dissipated": 1e-3}, 4) == [
        "the law as printed in the report created 5e-07 J per cycle, 0.2 % of the energy that it dissipated; "
        'with friction.reading = "stretch" no energy is created'
    ]
    assert warn_of_created_energy(model, {"created": 0.0, "dissipated": 1e-3}, 4) == []
    assert (
        warn_of_created_energy(
            build(load_rig_scene(tmp_path, reading="stretch")),
            {"created": 1.0, "dissipated": 1.0},
            4,
        )
        == []
    )
