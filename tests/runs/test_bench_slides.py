"""Slides of a bench with a rest in them or read from a table: the path itself, and what ageing at rest must give."""

import math

import numpy as np
import pytest
from command_line import cli
from friction_forms import steady_bond_length
from scene_texts import COULOMB, POINT
from scipy.integrate import quad, solve_ivp

from patchfem import build, plan, run
from patchfem.core import PatchfemError
from patchfem.runs.bench import bench
from patchfem.scene import load, loads

SPEED, LENGTH, RATIO, A_S, L_K, FLOOR = 1e-3, 2e-6, 0.5, 2e-6, 1e-6, 1e-6
NONLOCAL = """[friction]
law = "nonlocal"
static = 0.3
kinetic = 0.15
bond_length = "2 um"
rest_growth = "2e-6 m/s^2"
slip_growth = "1 um"
rest_speed = "1 um/s"
"""
DWELL = '[slide]\nkind = "dwell"\nspeed = "1 mm/s"\ndistance = "40 um"\nhold = "0.3 s"\ndistance_after = "20 um"\n'


def healed(hold, scale=1.0):
    """(bond length when the rest begins, when it ends), 2.10 with v = 0: eps_0 - (eps_0 - eps) exp(-a_s t/v_h)."""
    slow = steady_bond_length(SPEED, LENGTH * scale, RATIO, A_S, L_K * scale)
    return slow, LENGTH * scale - (LENGTH * scale - slow) * np.exp(-A_S * hold / FLOOR)


def restart(hold, x, scale=1.0):
    """F/(mu_s N) at x [m] after a rest: dz/dx = 1 - z/eps with 2.10 along the path, integrated on its own."""
    slow, start = healed(hold, scale)
    rate = A_S / SPEED**2 + 1 / (L_K * scale)
    found = solve_ivp(
        lambda y, z: 1 - z / (slow + (start - slow) * np.exp(-rate * y)),
        (0, 20e-6 * scale),
        [slow],
        method="DOP853",
        rtol=1e-12,
        atol=1e-18,
        max_step=1e-7 * scale,
        dense_output=True,
    )
    return found.sol(np.clip(x, 0, None))[0] / (LENGTH * scale)


def breakaway(hold, scale=1.0):
    """(largest, last) F/(mu_s N) of the 20 um after a rest."""
    curve = restart(hold, np.linspace(0, 20e-6, 100_001) * scale, scale)
    return curve.max(), curve[-1]


def steps_of(model) -> int:
    """Steps per cycle as a run of the bench takes them."""
    return model.slide.steps(
        model.accuracy.tolerance, model.accuracy.steps_per_cycle, model.friction.bond_length
    )


def sliding(text, *sets, steps=None):
    model = build(loads(text, sets=sets))
    return bench.run(model, None, steps or steps_of(model))


@pytest.fixture
def table(tmp_path):
    def write(text, friction=COULOMB, *sets):
        (tmp_path / "path.csv").write_bytes(text.encode() if isinstance(text, str) else text)
        scene = tmp_path / "scene.toml"
        scene.write_text(POINT + friction + '[slide]\nkind = "file"\nfile = "path.csv"\n', "utf-8")
        return load(scene, sets)

    return write


# ---- the dwell


def test_exact_the_dwell_is_slide_rest_slide():
    path = build(loads(POINT + NONLOCAL + DWELL)).slide
    time, slide, first, omega = path.samples(600)
    speed = np.diff(slide) / np.diff(time)
    rest = np.abs(np.diff(slide)) < 1e-18
    assert (first, omega) == (0, 0.0) and path.peak_speed == SPEED
    assert time[-1] == pytest.approx(0.36, rel=1e-12) and slide[-1] == pytest.approx(
        60e-6, rel=1e-12
    )
    assert np.diff(time)[rest].sum() == pytest.approx(0.3, rel=1e-12)
    assert (np.diff(slide)[rest] == 0).all() and speed[~rest] == pytest.approx(SPEED, rel=1e-9)
    assert slide[1:][rest] == pytest.approx(40e-6, rel=1e-12)


@pytest.mark.parametrize("hold", [0.0, 0.03, 0.3, 3.0])
def test_exact_the_breakaway_follows_the_growth_at_rest(hold):
    """The peak after the rest over mu_s N, against the same law integrated by a Runge-Kutta method of order 8."""
    found = sliding(
        POINT + NONLOCAL + DWELL, f"slide.hold={hold} s", "accuracy.steps_per_cycle=6000"
    )
    after = found.force[found.slide >= 39.999e-6] / (0.3 * found.load[0])
    assert after[0] == pytest.approx(healed(hold)[0] / LENGTH, rel=1e-5)
    assert after.max() == pytest.approx(breakaway(hold)[0], rel=2e-5)
    assert found.values["friction_ratio_end"] == pytest.approx(
        0.3 * healed(hold)[0] / LENGTH, rel=1e-4
    )


def test_order_of_the_restart_is_two():
    """The whole force after the rest, not its largest sample, which jumps from sample to sample."""
    miss = []
    for steps in (600, 1200, 2400):
        found = sliding(POINT + NONLOCAL + DWELL, steps=steps)
        after = found.slide >= 39.9999e-6
        truth = restart(0.3, found.slide[after] - 40e-6)
        miss.append(np.abs(found.force[after] / (0.3 * found.load[0]) - truth).max())
    assert miss[1:] == pytest.approx([miss[0] / 4, miss[0] / 16], rel=0.02) and miss[2] < 2e-6


@pytest.mark.parametrize("order", [0, 1])
def test_exact_the_printed_law_grows_its_force_at_rest(order):
    """Every bond grows its own length from 0 on the way and then at rest; the force is their sum, by quadrature."""
    found = sliding(
        POINT + NONLOCAL + DWELL, "friction.reading=report", f"friction.order={order}", steps=1200
    )
    rest = np.flatnonzero(np.diff(found.slide) == 0)
    slow, _ = healed(0)
    for k in (*rest, rest[-1] + 1):
        left = np.exp(-A_S * (found.time[k] - 0.04) / FLOOR)

        def force(y, left=left):
            own = LENGTH - (LENGTH + slow * np.expm1(-(A_S / SPEED**2 + 1 / L_K) * y)) * left
            return (y / own) ** order * np.exp(-y / own)

        truth = quad(force, 0, 40e-6, epsabs=1e-16, epsrel=1e-10, limit=400)[0] / LENGTH
        assert found.force[k] / (0.3 * found.load[0]) == pytest.approx(truth, rel=2e-5)
    assert found.force[rest[-1] + 1] > 1.2 * found.force[rest[0]]


# ---- the table


HEAD = "time [s],displacement [um]\n"


@pytest.mark.parametrize("text, says", [
    ("", ":1: a header like"), ("0,0\n1,1\n", ":1: a header like"), ("time,displacement\n0,0\n1,1\n", ":1: a header"),
    ("time [s],displacement [um],x [m]\n", ":1: a header"), ("time [s],time [s]\n", ":1: a header"),
    ("time [s],displacement [N]\n0,0\n1,1\n", ":1: displacement [N]: unknown unit; use one of m, km"),
    (HEAD, ":1: a path needs at least two rows"), (HEAD + "0,0\n\n", ":2: a path needs at least two rows"),
    (HEAD + "0,0\n1,nan\n", ":3: displacement: 'nan' is not a finite number"),
    (HEAD + "0,0\n1,1e999\n", ":3: displacement: '1e999' is not"), (HEAD + "0,0\n1;1\n", ":3: two cells"),
    (HEAD + "0,0\n\n1,1\n", ":3: two cells"), (HEAD + "0,0\n1,1,2\n", ":3: two cells"),
    (HEAD + "0,0\n1,\n", ":3: displacement: '' is not"), (HEAD + "0,0\n1,1\n1,2\n", ":4: time 1 s is not later than"),
    (HEAD + "0,5\n1,1\n", ":2: displacement starts at 5e-06"), (HEAD + "1,0\n2,1\n", ":2: time starts at 1"),
    (HEAD + "0,0\n1,0\n", "displacement is 0 in every row"), (b"\xff\xfe\x00", "cannot be read"),
])  # fmt: skip
def test_refuses_a_broken_table_by_line(table, text, says):
    scene = table(text)
    with pytest.raises(PatchfemError) as error:
        plan(scene)
    assert "path.csv" in str(error.value) and says in str(error.value)


@pytest.mark.parametrize("kind", ["dwell", "file"])
def test_exact_results_of_both_kinds_are_written(tmp_path, kind):
    text = (
        POINT
        + NONLOCAL
        + (DWELL if kind == "dwell" else '[slide]\nkind = "file"\nfile = "path.csv"\n')
    )
    (tmp_path / "scene.toml").write_text(text, "utf-8")
    (tmp_path / "path.csv").write_text(HEAD + "0,0\n0.04,40\n0.34,40\n0.36,60\n", "utf-8")
    answer = cli("run", tmp_path / "scene.toml", "-o", tmp_path / "out")
    assert answer.code == 0, answer.err
    result = run(load(tmp_path / "scene.toml"))
    assert f"slide.kind={kind}" in result.plan.effects
    peak = result.measures["friction_ratio_peak"]
    end = result.measures["friction_ratio_end"]
    best, last = breakaway(0.3)
    assert abs(peak.value - 0.3 * best) <= peak.error < 1e-3 * peak.value
    assert abs(end.value - 0.3 * last) <= max(end.error, 1e-9)
    assert "drift_per_cycle" not in result.measures


def test_exact_coulomb_breaks_away_at_its_static_friction():
    """At the first instant and after a rest the force is mu_s N, while sliding mu_k N; the work knows only mu_k."""
    run_ = sliding(POINT + COULOMB + "kinetic = 0.2\n" + DWELL)
    load = run_.load[0]
    force = run_.force
    moves = np.diff(run_.slide) > 0
    ends = np.flatnonzero(moves & ~np.append(False, moves[:-1]))
    assert ends.size == 2 and force[ends] == pytest.approx(0.3 * load, rel=1e-14)
    assert np.delete(force, ends) == pytest.approx(0.2 * load, rel=1e-14)
    assert run_.values["friction_ratio_peak"] == pytest.approx(0.3)
    assert run_.values["friction_ratio_end"] == 0.2
    assert run_.values["friction_work"] == pytest.approx(0.2 * load * 60e-6, rel=1e-12)


@pytest.mark.parametrize("speed", ["1e-160 m/s", "1e-300 m/s"])
@pytest.mark.parametrize("keys", ["", 'reading = "report"\n'])
def test_exact_endlessly_slow_slides_are_those_of_full_grown_bonds(speed, keys, recwarn):
    slow = sliding(
        POINT
        + NONLOCAL
        + keys
        + f'[slide]\nkind = "constant"\nspeed = "{speed}"\ndistance = "20 um"\n'
    )
    assert slow.values["friction_ratio_end"] == pytest.approx(0.3 * (1 - math.exp(-10)), rel=1e-3)
    assert all(np.isfinite(value) for value in slow.values.values()) and not recwarn.list


def test_refuses_a_slide_of_more_steps_than_memory_holds(tmp_path):
    scene = tmp_path / "a.toml"
    scene.write_text(
        POINT + COULOMB + '[slide]\nkind = "triangle"\namplitude = "1 um"\nspeed = "1 mm/s"\n'
        "cycles = 1e9\n"
    )
    answer = cli("plan", scene)
    assert answer.code == 4 and "lower slide.cycles" in answer.err
