"""Do the error bars of a march hold the true error? Random scenes against themselves at 6400 or 12800 steps a cycle."""

from dataclasses import replace

import numpy as np
import pytest

from patchfem.core import Measure
from patchfem.model.model import build
from patchfem.response.errors import (
    GROWS,
    LOOSE,
    MAIN,
    SURE,
    cells_error,
    change,
    orders,
    pieces_error,
    step_error,
    tolerance_error,
    typical_change,
    unseen,
    with_errors,
)
from patchfem.response.rows import floor_of
from patchfem.runs.plan import plan
from patchfem.runs.rig import march as rig_march
from patchfem.runs.rig.numerics import choose
from patchfem.runs.run import run
from patchfem.scene import scene

TEXT = """
[normal]
load = "100 N"
[friction]
law = "{law}"
static = {static}
bond_length = "{length} um"
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = {damping}
slide = 1.0
{other}
[drive]
kind = "base"
frequency = "{frequency} Hz"
acceleration = "5 g"
cycles = {cycles}
"""
OTHER = """[[structure.mode]]
name = "yaw"
frequency = "{} Hz"
damping = 0.01
slide = {}
"""


def random_scene(rng):
    other = OTHER.format(rng.uniform(60, 400), rng.uniform(0.05, 0.3)) if rng.random() < 0.5 else ""
    return scene.loads(TEXT.format(
        law=rng.choice(["nonlocal", "elastic-plastic"]), static=rng.uniform(0.2, 0.55), length=10 ** rng.uniform(-1, 1),
        damping=rng.choice([0.003, 0.01, 0.05]), other=other, frequency=rng.uniform(110, 180),
        cycles=rng.choice([20, 60])))


def coverage(count, seed, finest=12800):
    """Share of (scene, measure) pairs whose error bar holds the true error, off `finest` steps a cycle."""
    rng, held = np.random.default_rng(seed), []
    for _ in range(count):
        model = build(random_scene(rng))
        numerics = choose(model)
        runs = {n: rig_march.run_march(model, replace(numerics, steps=n), None).values
                for n in (400, 200, 100, finest)}
        errors = step_error(runs[400], runs[200], runs[100], 400)
        truth = change(runs[400], runs[finest])
        for name, measure in with_errors(runs[400], errors).items():
            if name in truth and name != "energy_balance":
                held.append(truth[name] <= measure.error + measure.floor)
    return float(np.mean(held))


def test_always_error_bars_hold_the_true_error():
    assert coverage(6, 5, 6400) >= 0.95


@pytest.mark.slow
def test_always_error_bars_hold_the_true_error_of_many_scenes():
    assert coverage(40, 6) >= 0.95


def test_exact_a_phase_is_compared_modulo_pi():
    assert change({"slip_start_phase": 0.01}, {"slip_start_phase": np.pi - 0.01})["slip_start_phase"] == \
        pytest.approx(0.02)


NAME = "relative_displacement_amplitude"


def test_exact_a_chance_coincidence_does_not_hide_the_error():
    """Equal values at the last two steps, a change before: a quarter of that change stays as the error, as if it were
    that of second order."""
    assert step_error({NAME: 2.0}, {NAME: 2.0}, {NAME: 2.4}, 400)[NAME] >= 0.1


def test_always_a_phase_is_as_uncertain_as_a_stick_that_few_steps_do_not_see():
    """Measures of seed 9510 at 352, 176 and 88 steps: two phases alike by chance; the independent program's."""
    found = step_error({"slip_start_phase": 0.0360050, "stick_fraction": 0.0143384},
                       {"slip_start_phase": 0.0359790, "stick_fraction": 0.0083417}, {"stick_fraction": 0.0}, 352)
    assert abs(0.0360050 - 0.0416259) <= found["slip_start_phase"] <= 0.05


@pytest.mark.parametrize("order", [1.75, 2.0, 2.25])
@pytest.mark.parametrize("sign", [1, -1])
def test_exact_runs_that_show_their_order_have_the_error_of_richardson(order, sign):
    """v(h) = 1 + c h^p at h = 1, 2, 4: the error c, times the safety factor, whatever its sign."""
    fine, half, quarter = ({NAME: 1 + sign * 1e-3 * h**order} for h in (1, 2, 4))
    assert step_error(fine, half, quarter, 400)[NAME] == pytest.approx(SURE * 1e-3, rel=1e-9)


@pytest.mark.parametrize(("order", "share"), [(1.4, 1.0), (1.6, 1.0), (2.4, (4**2.4 - 2**2.4) / 12), (3.0, 56 / 12)])
def test_exact_of_a_higher_order_no_more_than_the_second_is_believed(order, share):
    """v(h) = 1 + c h^p: below second order the error c; above it a twelfth of the change from 4 to 2 steps."""
    fine, half, quarter = ({NAME: 1 + 1e-3 * h**order} for h in (1, 2, 4))
    assert step_error(fine, half, quarter, 400)[NAME] == pytest.approx(SURE * share * 1e-3, rel=1e-9)


def test_exact_changes_that_turn_their_sign_keep_the_larger_one():
    """3 and -1, then 3 and 1: the sign alone tells that no order is shown."""
    turned, same = ({NAME: 1.0}, {NAME: 1.0 + 1e-3}, {NAME: 1.0 - 2e-3}), ({NAME: 1.0}, {NAME: 1.001}, {NAME: 1.004})
    assert step_error(*turned, 400)[NAME] == pytest.approx(LOOSE * 1e-3, rel=1e-9)
    assert step_error(*same, 400)[NAME] == pytest.approx(SURE * 1e-3 / 2, rel=1e-9)


def test_always_no_order_is_believed_where_coarser_runs_alone_have_a_loop():
    """A finest run that ends before its loop closes: the change stands as it does where no order is shown."""
    fine, half, quarter = ({"friction_work": 1 + 1e-3 * h**2} for h in (1, 2, 4))
    assert step_error(fine, half, quarter, 400)["friction_work"] == pytest.approx(SURE * 1e-3, rel=1e-9)
    half["loop_area"] = quarter["loop_area"] = 1.0
    assert step_error(fine, half, quarter, 400)["friction_work"] == pytest.approx(LOOSE * 3e-3, rel=1e-9)


def test_exact_a_peak_that_two_runs_read_at_one_sample_errs_by_first_order():
    """Equal at the last two steps: they share samples. An amplitude, which is not read at one, errs by half of that."""
    runs = [{NAME: 1.0, "absolute_acceleration_peak": 1.0 + gap} for gap in (0.0, 0.0, 1e-3)]
    assert step_error(*runs, 400)["absolute_acceleration_peak"] == pytest.approx(GROWS * LOOSE * 1e-3 / 2, rel=1e-9)
    runs = [{NAME: 1.0 + gap} for gap in (0.0, 0.0, 1e-3)]
    assert step_error(*runs, 400)[NAME] == pytest.approx(GROWS * LOOSE * 1e-3 / 4, rel=1e-9)


def test_always_a_force_peak_at_a_jump_that_agrees_by_chance_is_held():
    """Seed 42000029, a weakening limit on 364, 182 and 91 steps: 4e-6 and 4e-3 of it, and the independent program's."""
    peak, gap = 15.167624830341591, -4e-6 * 15.167624830341591
    runs = [{"friction_force_peak": one} for one in (peak, peak - gap, peak - gap + 978.63 * gap)]
    assert abs(15.203855518276447 - peak) <= step_error(*runs, 364)["friction_force_peak"] <= 0.1


@pytest.mark.parametrize("order", [0.5, 1.0, 1.5, 3.0, 4.0])
def test_always_runs_of_another_order_have_a_bar_that_holds(order):
    """From first order on; below it three runs can only say that nothing converges yet."""
    fine, half, quarter = ({NAME: 1 + 1e-3 * h**order} for h in (1, 2, 4))
    assert step_error(fine, half, quarter, 400)[NAME] >= (1e-3 if order >= 1 else 0.45e-3)


def test_always_a_measure_that_hardly_changes_knows_what_the_others_do():
    """The main measures change by 1e-3 of their size without an order; a loop area that stayed has a share of it."""
    values = {name: 3.0 for name in MAIN}
    half, quarter = ({name: 3.0 * (1 + gap) for name in MAIN} for gap in (1e-3, -1e-3))
    half["loop_area"] = quarter["loop_area"] = 3.0 + 1e-9
    assert step_error(values, half, quarter, 400)["loop_area"] >= 0.2 * 3e-3


def test_exact_the_stiffness_of_a_slipping_contact_knows_its_whole_harmonic():
    """Against the slide the force is a hundred times the part with it: an angle that changes by 1e-3 changes the
    stiffness by a tenth, and a bar that is a share of its value alone would be a hundredth of that."""
    values = {name: 1.0 for name in MAIN} | {"equivalent_stiffness": 1.0, "loop_area": 100 * np.pi}
    half, quarter = ({name: v * (1 + gap) for name, v in values.items()} for gap in (1e-3, -1e-3))
    half["equivalent_stiffness"] = quarter["equivalent_stiffness"] = 1.0 + 1e-6
    assert step_error(values, half, quarter, 400)["equivalent_stiffness"] >= 0.4e-3 * np.hypot(100, 1)


def test_always_a_march_claims_no_digit_far_below_the_floor():
    """Three runs that agree by chance to 1e-14 m: a tenth of the floor of 1e-10 m stays."""
    values = {NAME: 1e-9}
    assert step_error(values, {NAME: 1e-9 + 1e-14}, {NAME: 1e-9 + 4e-14}, 400)[NAME] == pytest.approx(1e-11)


RUBBING = """[normal]
load = "{load} N"
[friction]
law = "coulomb"
static = 0.3
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "one"
frequency = "143 Hz"
damping = 0.02
slide = 1.0
[drive]
kind = "base"
frequency = "120 Hz"
acceleration = "{size} g"
cycles = 30
[accuracy]
method = "march"
"""


def test_exact_a_small_drive_is_met_as_a_large_one():
    """Drive and load a billion times smaller: the same steps and the same relative errors. With 1e-10 m beside 6e-14 m
    any error was small enough."""
    large, small = (run(plan(scene.loads(RUBBING.format(load=30 * size, size=5 * size)))) for size in (1.0, 1e-9))
    assert small.extra["steps_per_cycle"] == large.extra["steps_per_cycle"]
    one, other = small.measures[NAME], large.measures[NAME]
    assert one.value == pytest.approx(1e-9 * other.value, rel=1e-9)
    assert one.error == pytest.approx(1e-9 * other.error, rel=1e-3) and one.error < 1e-3 * one.value
    assert other.floor == 1e-10 and one.floor == pytest.approx(
        1e-5 * 5e-9 * 9.80665 / (2 * np.pi * 120)**2, rel=1e-12)
    assert floor_of(NAME, 0.0) == floor_of(NAME) == 1e-10 and floor_of("loop_area", 1e-12) == 1e-10


def test_exact_a_release_lies_between_two_samples():
    """Runs that agree still leave the release open by a share of their step, whatever the law; all else not."""
    same = {"slip_start_phase": 0.6, "stick_fraction": 0.2, NAME: 1.0}
    found = step_error(same, same, same, 128)
    assert found == {"slip_start_phase": pytest.approx(1 / 128), "stick_fraction": pytest.approx(0.35 / 128), NAME: 0.0}


PHASES = [{"slip_start_phase": phase} for phase in (0.9929833, 0.9917635, 0.9939987)]  # at 128, 64 and 32 steps


def test_always_a_march_on_few_steps_knows_when_its_slip_starts():
    """Seed 500011 of `motion_scenes`, elastic-plastic on 128 steps, and the independent program's phase."""
    found = step_error(*PHASES, 128)
    assert 0.0038122 <= found["slip_start_phase"] <= 0.0314


def test_always_runs_with_a_quarter_of_the_cells_hold_an_error_of_second_order():
    """v(N) = v + c/N^2 with c = 1e-6 N^2: three times the error, by the larger of two changes, and where one measure
    stayed by chance in both a share of what others show."""
    values = {name: 1.0 for name in MAIN}
    coarse = {name: 1.0 + 15e-6 for name in MAIN} | {"loop_area": 1.0}
    found = cells_error(values, values, coarse)
    assert found[NAME] == pytest.approx(3e-6) and found["loop_area"] >= 0.29e-6
    assert "loop_area" not in cells_error(values, coarse, {NAME: 1.0})  # a run that stops before it says nothing


def test_always_steps_that_meet_a_tolerance_claim_no_digit_far_below_the_floor():
    """Two runs that agree by chance to 1e-18 m: a hundredth of the floor of 1e-10 m stays."""
    assert tolerance_error({NAME: 1e-9}, {NAME: 1e-9 + 1e-18})[NAME] == pytest.approx(1e-12)
    assert tolerance_error({NAME: 1e-3}, {NAME: 1e-3 + 1e-9})[NAME] == pytest.approx(0.5e-9)


def test_always_what_has_come_to_rest_does_not_widen_the_bars_of_what_is_known():
    """Of a decayed motion 1e-32 m and 2e-31 m are both at rest; its load and its friction work are known to 1e-9."""
    fine = {NAME: 1e-32, "absolute_acceleration_peak": 1e-20, "friction_work": 1e-3, "normal_load": 15.0}
    coarse = {NAME: 2e-31, "absolute_acceleration_peak": 5e-19, "friction_work": 1e-3 + 1e-12, "normal_load": 15.0}
    found = tolerance_error(fine, coarse)
    assert found["normal_load"] < 1e-7 and found["friction_work"] < 1e-11


@pytest.mark.parametrize("name", ["energy_balance", "work_check"])
def test_exact_bars_of_what_is_an_error_itself_have_no_share_of_its_floor(name):
    """A balance of 2e-13 is told as such, not as 2e-13 +- 1e-9."""
    runs = [{"relative_displacement_amplitude": 1.0 + gap, name: 1e-13 * (2 + gap)} for gap in (0.0, 1e-6, 5e-6)]
    assert step_error(*runs, 400)[name] < 1e-12 and tolerance_error(*runs[:2])[name] < 1e-12


def test_exact_what_counts_samples_is_open_by_some_of_them():
    """Runs that agree to the last digit: a share of time still hangs on four samples of a cycle."""
    same = {"open_fraction": 0.25, NAME: 1.0}
    assert step_error(same, same, same, 400) == {"open_fraction": pytest.approx(4 / 400), NAME: 0.0}


def test_exact_a_bar_knows_what_kind_of_number_it_belongs_to():
    """Error of the parts and a share of the value; a phase modulo pi is at most a quarter turn off; a balance is 0 but
    for its error; a drift is a difference of means with digits of the amplitude."""
    values = {NAME: 2e-3, "slip_start_phase": 3.0, "energy_balance": 4e-9, "drift_per_cycle": 1e-12}
    parts = {NAME: 1e-6, "slip_start_phase": 1.8, "energy_balance": 1e-10, "drift_per_cycle": 1e-15}
    found = {name: one.error for name, one in with_errors(values, parts, least=1e-9).items()}
    assert found == {NAME: pytest.approx(1e-6 + 2e-12, rel=1e-12), "slip_start_phase": np.pi / 2,
                     "energy_balance": 4e-9, "drift_per_cycle": pytest.approx(1e-15 + 1e-9 * 2e-3 + 1e-21, rel=1e-9)}
    least = with_errors(values, parts)["drift_per_cycle"].error
    assert least == pytest.approx(1e-15 + 1e-13 * 2e-3, rel=1e-9)


def test_exact_the_work_of_an_interface_that_holds_tells_nothing_of_other_measures():
    """Its work is round-off and changes by its own size; a stiffness of second order keeps the error of its order."""
    secant = [2181498911.1374044, 2180691499.6111064, 2177462849.5403247]  # at 400, 200 and 100 steps, order 2.000
    work = [8.470329472543003e-22, -8.470329472543003e-22, 0.0]
    runs = [{"secant_stiffness": k, "loop_area": w, "friction_work": 3e-21 + w} for k, w in zip(secant, work)]
    found = step_error(*runs, 400)
    truth = secant[0] + (secant[0] - secant[1]) / 3
    assert abs(truth - secant[0]) < found["secant_stiffness"] < 3 * abs(truth - secant[0])
    sizes = {"relative_displacement_amplitude": 1e-9, "loop_area": 2e-12}
    values = {"relative_displacement_amplitude": 1e-6, "loop_area": 1e-12}
    assert typical_change(values, sizes) == pytest.approx(1e-3)  # the work is below its floor
    small = {"loop_area": 1e-12}
    assert typical_change(small, {"loop_area": 1e-14}) == pytest.approx(1e-2)  # nothing else tells


def test_exact_orders_are_those_that_the_changes_show():
    """h^p for p of 1, 2 and 4, which counts as 2; what does not fall, or does not change, has none."""
    def at(h):
        return {"one": 1 + h, "two": 1 + h**2, "four": 1 + h**4, "grows": 1 - np.log2(h), "none": 1.0, "slow": h**0.3}

    found = orders(at(1.0), at(2.0), at(4.0))
    assert found == {"one": pytest.approx(1.0), "two": pytest.approx(2.0), "four": pytest.approx(2.0)}


def test_exact_an_amplitude_that_agrees_by_chance_errs_with_those_that_do_not():
    """Half of the largest relative change of four measures of the stiffness; a limit and a work err by their own."""
    fine = {"relative_displacement_amplitude": 1.0, "absolute_acceleration_peak": 100.0, "friction_force_peak": 30.0,
            "secant_stiffness": 1e6, "loop_area": 2.0, "energy_balance": 1e-12}
    coarse = fine | {"relative_displacement_amplitude": 1.0001, "absolute_acceleration_peak": 102.0,
                     "secant_stiffness": 0.99e6, "loop_area": 2.2, "energy_balance": 3e-12}
    found = pieces_error(fine, coarse)
    assert found["absolute_acceleration_peak"] == pytest.approx(3.0)
    assert found["relative_displacement_amplitude"] == pytest.approx(0.015)
    assert found["secant_stiffness"] == pytest.approx(0.015e6)
    assert found["friction_force_peak"] == 0
    assert found["loop_area"] == pytest.approx(0.3) and found["energy_balance"] == pytest.approx(2e-12)


def test_exact_no_slip_of_a_mesh_is_known_to_its_floor_only():
    """An edge slips within an element: the loss of a loop is 4 F u at most."""
    found = {"slip_amplitude": Measure(0.0, "m", 0.0, 1e-13), "friction_force_peak": Measure(3.0, "N", 0.0, 1e-6),
             "loop_area": Measure(0.0, "J", 0.0, 1e-10), "energy_dissipated": Measure(0.0, "J", 0.0, 1e-10)}
    bars = {name: one.error for name, one in unseen(found, 20.0).items()}
    assert bars == pytest.approx({"slip_amplitude": 1e-10, "friction_force_peak": 0.0, "loop_area": 1.2e-9,
                                  "energy_dissipated": 2.4e-8})
    assert str(unseen(found, 20.0)["slip_amplitude"]).startswith("0 ± 0.1 nm")
    slips = found | {"slip_amplitude": Measure(1e-6, "m", 1e-9, 1e-10)}
    assert unseen(slips, 20.0) == slips
