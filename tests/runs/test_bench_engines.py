"""A bench on the compiled engines: against the laws stepped in NumPy, its error bar, its energy, its progress."""

from dataclasses import replace

import numpy as np
import pytest

from patchfem import SceneError, build, plan
from patchfem.core import Missing
from patchfem.friction import MAX_LIST_SECONDS, steady_loop
from patchfem.runs import PassOptions, solve_with_coarser
from patchfem.runs.bench import bench
from patchfem.runs.bench.ledger import N_BLOCK_SAMPLES, Slide
from patchfem.runs.bench.stepped import slide_step_by_step
from patchfem.runs.run import run
from patchfem.scene import loads

POINT = '[normal]\nload = "100 N"\n'
PATCH = (
    '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\nload = "100 N"\n'
    'element_size = "0.5 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n[contact.tilt]\nangle = "0.02 mrad"\n'
)
FRICTION = "[friction]\nstatic = 0.3\n"
BONDS = 'law = "nonlocal"\nbond_length = "2 um"\n'
GROWTH = 'kinetic = 0.15\nrest_growth = "2 m/s^2"\nslip_growth = "1 um"\nrest_speed = "10 um/s"\n'
SLIDES = {
    "sine": 'kind = "sine"\namplitude = "4 um"\nfrequency = "50 Hz"\ncycles = 2\n',
    "small": 'kind = "sine"\namplitude = "0.1 um"\nfrequency = "50 Hz"\ncycles = 2\n',
    "dwell": 'kind = "dwell"\nspeed = "1 mm/s"\ndistance = "20 um"\nhold = "0.3 s"\ndistance_after = "10 um"\n',
}  # fmt: skip
EXACT = {
    "coulomb": 'law = "coulomb"\n', "coulomb that holds more": 'law = "coulomb"\nkinetic = 0.2\n',
    "tanh": 'law = "tanh"\nreference_speed = "1 mm/s"\n',
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "2 um"\n',
    "averaged": 'law = "convolution"\nbond_length = "0.8 mm"\n',
    "bonds": BONDS + "initial_bonds = 0.4\n", "growing": BONDS + GROWTH, "loose": BONDS + GROWTH + "breakaway = 0.3\n",
}  # fmt: skip
SUMS = (
    [("stretch", order, growth) for order in (0, 0.5, 2.5) for growth in ("", GROWTH)]
    + [("report", order, growth) for order in (0, 0.5, 1, 2) for growth in ("", GROWTH)]
    + [("report", -0.5, "")]
)


def model_of(law, slide, *sets, where=POINT):
    return build(loads(where + FRICTION + law + "[slide]\n" + SLIDES[slide], sets=sets))


def sum_of(reading, order, growth):
    return (
        BONDS
        + growth
        + f'reading = "{reading}"\norder = {order}\n'
        + ("initial_bonds = 0\n" if order < 0 else "")
    )


def both(model, steps, patch=None, frames=0):
    time, slide = model.slide.samples(steps)[:2]
    return bench.run(model, patch, steps, frames), slide_step_by_step(
        Slide(model, patch, time, slide, frames)
    )


# ---- the compiled engines and their twins


@pytest.mark.share(0, 2, 4, 6, 8, 10, 13, 15, 17, 19, 21, 23)
@pytest.mark.parametrize("slide", SLIDES)
@pytest.mark.parametrize("law", EXACT)
def test_exact_a_compiled_bench_is_its_law_step_by_step(law, slide):
    one, two = both(model_of(EXACT[law], slide), 80)
    limit = np.abs(two.force).max()
    assert one.force == pytest.approx(two.force, abs=1e-13 * limit)
    assert one.slip == pytest.approx(two.slip, abs=1e-18)
    assert one.ledger == pytest.approx(two.ledger, abs=1e-13 * np.abs(np.diff(two.ledger[0])).sum())


@pytest.mark.share(0, 4, 8, 12)
@pytest.mark.parametrize(
    "reading, order, growth, slide",
    [
        pytest.param(*law, slide, marks=() if (k + n) % len(SLIDES) == 0 else pytest.mark.slow)
        for k, law in enumerate(SUMS)
        for n, slide in enumerate(SLIDES)
    ],
)
def test_exact_a_list_of_bonds_is_the_numpy_sum_within_its_stated_error(
    reading, order, growth, slide
):
    """1e-5 besides for the two points per strip, which fall with the step; a third of all laws and slides always."""
    one, two = both(model_of(sum_of(reading, order, growth), slide), 60)
    error = one.engine.choice.error + (2e-5 if growth else 1e-5)
    assert one.engine.name.endswith("bond list")
    assert np.abs(one.force - two.force).max() <= error * 30
    assert np.abs(one.ledger - two.ledger).max() <= 3 * error * np.abs(np.diff(two.ledger[0])).sum()


@pytest.mark.parametrize(
    "law", ["coulomb that holds more", "averaged", "elastic-plastic", "growing"]
)
def test_exact_frames_of_a_patch_are_those_of_its_points(law):
    model = model_of(EXACT[law], "sine", where=PATCH)
    patch = solve_with_coarser(model.patch, 1e-3, False)[0]
    one, two = both(model, 40, patch, 5)
    top = np.abs(two.tau).max()
    assert (one.frames == two.frames).all() and one.tau.shape == (5, patch.x.size)
    assert one.force == pytest.approx(two.force, abs=1e-12 * np.abs(two.force).max())
    assert one.tau == pytest.approx(two.tau, abs=1e-12 * top)
    assert one.local == pytest.approx(two.local, abs=1e-17)


# ---- what runs, and what it says of itself


@pytest.mark.share(0, 1, 2, 3, 4, 6, 7, 8)
@pytest.mark.parametrize("law, where, name", [
    (EXACT["coulomb"], POINT, "closed form"), (EXACT["elastic-plastic"], POINT, "parallel elements"),
    (BONDS, POINT, "recursion"), (BONDS + "order = 2\n", POINT, "merged bond list"),
    (BONDS + 'reading = "report"\n', POINT, "truncated bond list"),
    (BONDS + "order = 2\nbreakaway = 0.2\n", POINT, "law step by step"),
    (BONDS, PATCH + 'on = "lower"\n', "law step by step"), (BONDS, PATCH + "[contact.shear]\n", "bond points"),
    (EXACT["coulomb"], PATCH + "[contact.shear]\n", "parallel elements"),
])  # fmt: skip
def test_exact_a_plan_names_the_engine_that_runs(law, where, name):
    what = plan(model_of(law, "sine", "accuracy.steps_per_cycle=200", where=where))
    result = run(what, estimate=False)
    assert what.engine == result.extra["engine"] == result.response.engine.name == f"bench, {name}"
    assert ("bond_list_about" in what.unknowns) == name.endswith("list")


def test_refuses_a_list_that_takes_too_long_and_merging_where_none_is():
    model = model_of(
        BONDS + "order = 2\n",
        "sine",
        "accuracy.quadrature=direct",
        "slide.cycles=400",
        "accuracy.steps_per_cycle=4000",
    )
    with pytest.raises(
        Missing,
        match=f"more than the limit of {MAX_LIST_SECONDS:.0f} s; lower accuracy.steps_per_cycle",
    ):
        plan(model)
    with pytest.raises(SceneError, match=r"'merged' with friction\.breakaway, or with a pressure"):
        plan(
            model_of(
                BONDS + "order = 2\n",
                "sine",
                "accuracy.quadrature=merged",
                where=PATCH + 'on = "lower"\n',
            )
        )


@pytest.mark.parametrize("keys, slide", [
    ("order = 2\n", "sine"), ("order = 0.5\n", "small"), ('reading = "report"\norder = 0.5\n' + GROWTH, "sine"),
    (GROWTH + "order = 2\n", "dwell"),
])  # fmt: skip
def test_exact_the_bar_holds_the_error_of_the_sum(keys, slide):
    """Against the sum over every bond, nothing merged or cut off, at four times the steps."""
    sets = ["accuracy.tolerance=1e-2", "accuracy.quadrature=merged", "accuracy.steps_per_cycle=400"]
    model = model_of(BONDS + keys, slide, *sets)
    found = run(model)
    choice = found.response.engine.choice
    assert choice.engine == "merged" and choice.merge > 0
    assert found.measures["friction_force_peak"].error >= choice.error * 30
    steps = 4 * model.slide.steps(model.accuracy.tolerance, model.accuracy.steps_per_cycle, 2e-6)
    whole = replace(choice, engine="direct", merge=0.0, tail=0.0, error=0.0)
    truth = bench.run(model, None, steps, watch=PassOptions(whole))
    for name, measure in found.measures.items():
        if name not in ("work_check", "energy_balance"):
            assert abs(measure.value - truth.values[name]) <= measure.error + measure.floor, name


# ---- progress


@pytest.mark.parametrize(
    "law, where",
    [
        (EXACT["coulomb"], POINT),
        (BONDS, POINT),
        (BONDS + "order = 2\n", POINT),
        (EXACT["elastic-plastic"], PATCH + "[contact.shear]\n"),
        (EXACT["tanh"], PATCH + 'on = "lower"\n'),
    ],
)
def test_always_the_done_share_grows_to_one(law, where):
    told = []
    run(
        model_of(law, "sine", "accuracy.steps_per_cycle=6000", where=where),
        progress=told.append,
        estimate=False,
    )
    assert told[-1] == 1.0 and (np.diff([0.0, *told]) >= 0).all()
    assert len(told) >= (1 if law == EXACT["coulomb"] else 12000 // N_BLOCK_SAMPLES)


def test_always_an_interrupt_ends_a_bench_between_two_blocks():
    told = []

    def stop(share):
        told.append(share)
        if share > 0.5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(model_of(BONDS, "sine", "accuracy.steps_per_cycle=20000"), progress=stop)
    assert told[-1] <= 0.5 + N_BLOCK_SAMPLES / 40000


# ---- two books of energy


def test_exact_a_jump_of_the_force_at_a_turn_costs_the_check_nothing():
    for law in ("coulomb", "coulomb that holds more"):
        assert bench.run(model_of(EXACT[law], "sine"), None, 40).values["work_check"] < 1e-13


@pytest.mark.parametrize(
    "chi, beta, slide",
    [(-0.4, 0.5, 2e-7), (-0.4, 0.5, 2e-9), (0.0, 0.0, 2e-7), (-0.9, 2.0, 1e-5), (-0.6, 0.0, 3e-6)],
)
def test_exact_the_cells_of_iwans_law_are_in_the_bars(chi, beta, slide):
    """Segalman's closed form of the steady loop: its area and its tip, which a first loading has as well."""
    scene = loads(
        '[normal]\nload = "5 kN"\n[friction]\nlaw = "iwan"\nstatic = 0.3\nstiffness = "1e9 N/m"\n'
        f'chi = {chi}\nbeta = {beta}\n[slide]\nkind = "sine"\namplitude = "{slide!r} m"\n'
        'frequency = "1 Hz"\ncycles = 2\n'
    )
    tip, area = steady_loop(scene.friction, 5e3, slide)
    measures = run(scene).measures
    for name, exact in (
        ("loop_area", area),
        ("friction_force_peak", tip),
        ("secant_stiffness", tip / slide),
    ):
        off = abs(measures[name].value - exact)
        assert off <= measures[name].error + 1e-12 * abs(exact), name
    assert (
        0 < measures["loop_area"].error < 40 * abs(measures["loop_area"].value - area) + 1e-6 * area
    )
