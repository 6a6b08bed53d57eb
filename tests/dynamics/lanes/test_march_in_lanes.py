"""Cases marched side by side: against the text run as Python, against finer steps, and against the laws of energy."""

import numpy as np
import pytest

from patchfem.dynamics import Row
from patchfem.dynamics.lanes import reading, run
from patchfem.dynamics.lanes import rows_kernels as rows
from patchfem.friction import max_yield_displacement

FLOWS = tuple(f"friction.laws.{law}_kernels" for law in ("tanh", "stretch", "bouc_wen", "lugre"))
LAWS = "rigid", "yielding", "masing", "table", *FLOWS
ALWAYS = 0, 1, 2, 3, 5  # each law is a loop to compile: one of those that flow


def cases(law: str, count: int, seed: int = 1) -> run.Cases:
    """Random cases that slip, stop and stick, near resonance and away; static friction above kinetic in some."""
    r = np.random.default_rng(seed)
    square = r.uniform(0.3, 3, count) ** 2
    one = np.ones(count)
    slip = 10 ** r.uniform(-1.5, -0.1, count)
    spring = r.uniform(0.5, 5, count) if law in ("yielding", "masing") else 0 * one
    length = slip / np.where(spring > 0, spring, 1) * (spring > 0)
    numbers = np.zeros((count, 0))
    if law == "masing":
        chi = r.uniform(-0.9, 0, count)
        beta = r.choice([0, 0.3, 3], count)
        length = max_yield_displacement(slip, spring, chi, beta)
        slips = (chi + 1) / ((chi + 2) * (1 + beta) - 1)
        numbers = np.stack(
            [chi + 1, 1 / (1 + beta), np.minimum(1, (0.5 / slips) ** (1 / (chi + 2)))], axis=1
        )
    if law == "table":
        sets = [elements(r, one) for one in slip]
        spring, length = (np.array(part) for part in zip(*((k.sum(), y[-1]) for k, y in sets)))
        numbers = run.make_curve_tables(sets)
    if law in FLOWS:
        speed = slip * r.uniform(0.3, 2, count)
        length = (0 if "tanh" in law else 1) * r.uniform(0.6, 2, count)
        spring = np.divide(slip, length, out=0 * slip, where=length > 0)
        numbers = np.array(
            {
                "tanh": [slip, 1 / speed],
                "stretch": [spring, length],
                "bouc_wen": [slip, length, r.choice([1, 2, 1.5], count), r.uniform(0.5, 1, count)],
                "lugre": [
                    spring,
                    slip * r.uniform(0.6, 1, count),
                    slip,
                    speed,
                    *(r.uniform(0, 0.2, count) * slip / speed for _ in range(2)),
                ],
            }[law.split(".")[2].removesuffix("_kernels")]
        ).T
    return run.Cases(
        2 * np.sqrt(square) * 10 ** r.uniform(-1 if law in FLOWS else -3, -0.5, count),
        square,
        one,
        slip,
        slip * (r.choice([1, 1.3], count) if law == "rigid" else 1),
        spring,
        length,
        -one,
        one,
        0 * one,
        0.1 * r.choice([0, 1], count),
        numbers,
    )


def elements(r, limit: float) -> tuple:
    """(stiffness (t,), yield slide (t,) rising) of up to 60 random elements of a limit in all."""
    y = np.sort(limit * 10 ** r.uniform(-1.2, 0.3, r.integers(1, 60)))
    k = r.uniform(0.1, 1, y.size)
    return k * limit / (k @ y), y


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "law, size, most", [(FLOWS[0], 0.005, 1e-5), (FLOWS[1], 0.0033, 1e-4), (FLOWS[2], 0.0033, 2e-4)]
)
def test_always_a_thin_layer_needs_no_fine_steps(law, size, most):
    """A speed of reference of 1/200 of the speed, a bond length of 1/300 of the slide: so well do 128 steps a cycle
    know the amplitude. Without parts of a step tanh erred by up to 1e-3, by rates of the stretch bonds ran away."""
    some = cases(law, 40)
    tanh = law == FLOWS[0]
    numbers = np.stack(
        [some.kinetic, 0 * some.kinetic + 1 / size]
        if tanh
        else [some.kinetic / size, 0 * some.kinetic + size],
        1,
    )
    if law == FLOWS[2]:
        numbers = np.stack([some.kinetic, *(0 * some.kinetic + one for one in (size, 1.0, 0.5))], 1)
    some = some._replace(
        law=numbers,
        yield_length=0 * some.kinetic + (0 if tanh else size),
        spring=0 * some.kinetic if tanh else some.kinetic / size,
    )
    reach = [
        np.ptp(run.march(law, some, 40, 4, steps).history[:, -4:, :2], axis=(1, 2)) / 2
        for steps in (128, 2048)
    ]
    error = np.abs(reach[0] / reach[1] - 1)[reach[1] > 0.5]
    assert error.max() < most and error.size > 10


# each march of a law by itself compiles it
LEAPS = (
    "rigid",
    "yielding",
    "masing",
    "table",
    FLOWS[1],
)


@pytest.mark.parametrize("law", LEAPS)
def test_exact_a_case_leaps_to_where_it_would_march(law):
    """Motion, extremes and phasors of a march that leaps are those of a march by three cycles at a time, which never
    leaps."""
    some = cases(law, 60, 11)
    cycles = 150
    begun = run.initial_motion(law, some)
    history, motion = run.continue_march(law, some, begun, cycles, 96)
    parts = []
    step = begun
    for _ in range(cycles // 3):
        part, step = run.continue_march(law, some, step, 3, 96)
        parts.append(part)
    sizes = np.ptp(history[:, -1, :2], axis=1)
    apart = np.abs(history - np.concatenate(parts, axis=1)).max(axis=(1, 2))
    assert np.all(apart < 2e-6 * sizes) and np.mean(apart > 0) > 0.5
    for place in (Row.SLIDE, Row.SPEED, Row.MEMORY):
        assert np.all(np.abs(motion - step)[:, place] < 2e-6 * sizes)


def test_exact_a_case_does_not_leap_while_its_extremes_are_at_the_ends_of_its_cycles():
    """While this amplitude grows, the largest slide of a cycle is that of its end, and then moves to a turn. A leap
    extrapolated the first: the range was off by 1e-4 for good."""
    one = np.ones(1)
    none = np.zeros(1)
    some = run.Cases(
        0.00412636 * one,
        0.84066824 * one,
        one,
        0.83240466 * one,
        0.83240466 * one,
        4.75177243 * one,
        0.21020228 * one,
        -one,
        one,
        none,
        none,
        np.array([[0.50039206, 0.25, 1.0]]),
    )
    begun = run.initial_motion("masing", some)
    history = run.continue_march("masing", some, begun, 300, 96)[0]
    step = begun
    for _ in range(100):
        part, step = run.continue_march("masing", some, step, 3, 96)
    np.testing.assert_allclose(history[0, -1], part[0, -1], rtol=0, atol=1e-6)


@pytest.mark.share(*ALWAYS)
@pytest.mark.parametrize("law", LAWS)
def test_exact_a_case_is_the_same_in_any_company(law):
    """To the last bit: in another lane, with other cases beside it, and after another case in its lane."""
    some = cases(law, 70)
    order = np.random.default_rng(2).permutation(70)
    mixed = run.march(law, run.Cases(*(part[order] for part in some)), 30, 3, 48)
    whole = run.march(law, some, 30, 3, 48)
    for name in ("motion", "history", "readings", "n_before"):
        np.testing.assert_array_equal(getattr(mixed, name), getattr(whole, name)[order])


@pytest.mark.share(*ALWAYS)
@pytest.mark.parametrize("law", LAWS)
def test_order_of_events_is_above_three(law):
    """Between events a step is exact and an event is found to the fourth order, so the amplitudes of most cases
    converge faster than h^3; at 96 steps nine of ten are known to 1e-5, of the rate law to 1e-4. Behind a table, whose
    force bends at every yield, it is h^2 and 1e-4."""
    some = cases(law, 200)
    reach = [
        np.ptp(run.march(law, some, 60, 6, steps).history[:, -6:, :2], axis=(1, 2)) / 2
        for steps in (48, 96, 768)
    ]
    coarse, fine = (np.abs(one - reach[2]) / reach[2] for one in reach[:2])
    assert np.quantile(fine, 0.9) < (1e-4 if law in FLOWS or law == "table" else 1e-5)
    counts = coarse > 1e-9
    assert np.median(np.log2(coarse[counts] / np.maximum(fine[counts], 1e-14))) > (
        1.9 if law == "table" else 2.9
    )


@pytest.mark.share(*ALWAYS)
@pytest.mark.parametrize("law", LAWS)
def test_always_energies_balance(law):
    """What the drive gives is what friction and damping take and what is left: to 1e-4 of it at 96 steps in 98 of 100
    cases, and 8 times less at twice the steps in their middle, 4 times behind a table."""
    some = cases(law, 100)
    gaps = []
    for steps in (96, 192):
        book = reading.run_energies(law, some, run.march(law, some, 40, 4, steps), np.ones(100))
        gap = np.abs(book["work_in"] - book["stored"] - book["friction"] - book["viscous"])
        gaps.append(gap / (book["power"] + book["peak_stored"]))
    assert np.quantile(gaps[0], 0.98) < 1e-4 and np.median(gaps[0]) < 5e-6
    assert np.median(gaps[1]) < np.median(gaps[0]) / (3 if law == "table" else 5)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("law", ["masing", FLOWS[0]])
def test_always_a_march_that_ran_away_has_no_numbers_and_prints_nothing(law):
    """By 8 steps a cycle of a mode that is 10 times as fast; energies overflowed."""
    some = cases(law, 60, 3)
    some = some._replace(stiffness=some.stiffness * np.where(np.arange(60) % 2, 1, 100))
    found = run.march(law, some, 60, 6, 8)
    book = reading.run_energies(law, some, found, np.ones(60))
    angle = np.ones((60, 6, 2))
    reading.reading_of_runs(law, some, found, np.ones(60), np.ones(60), angle)
    assert np.isfinite(book["work_in"][1::2]).all() and np.isnan(book["work_in"][::2]).any()
    assert (np.isnan(book["stored"]) == np.isnan(found.motion[:, Row.SLIDE])).all()


def test_exact_without_friction_a_march_is_the_closed_form():
    """At any steps the motion after some cycles is that of the linear oscillator."""
    none = np.zeros(3)
    damp = np.array([0.02, 0.3, 2.5])
    square = np.array([1.0, 2.0, 1.3])
    some = run.Cases(
        damp,
        square,
        np.ones(3),
        none,
        none,
        none,
        none,
        np.ones(3),
        none,
        none,
        0.1 + none,
        np.zeros((3, 0)),
    )
    for steps in (16, 48):
        found = run.march("rigid", some, 7, 2, steps)
        for k in range(3):
            matrix = np.array([[0, 1], [-square[k], -damp[k]]])
            forced = 1 / (square[k] - 1 + 1j * damp[k])  # sin theta = Im exp(i theta)
            forced = np.array([forced.imag, forced.real])
            values, vectors = np.linalg.eig(matrix)
            turned = vectors @ np.diag(np.exp(values * 14 * np.pi)) @ np.linalg.inv(vectors)
            want = forced + (turned @ (np.array([0, 0.1]) - forced)).real
            np.testing.assert_allclose(found.motion[k, [Row.SLIDE, Row.SPEED]], want, atol=1e-12)


@pytest.mark.parametrize("law", ["table", "friction.laws.stretch_kernels"])
def test_exact_accelerations_are_those_of_the_equation(law):
    """At every fourth step, where a march of so many steps alone ends: by its motion and friction."""
    some = cases(law, 35)
    steps = 64
    begun = run.initial_motion(law, some)
    table = run.make_drive_table(64)
    found = run.output_accelerations(law, some, begun, 2, steps)
    motion = begun.copy()
    numbers = run.make_case_numbers(law, some, steps)
    for k in range(4, 2 * steps + 1, 4):
        first = (k - 4) % steps
        part = table[:, first : first + 5].copy()
        workspace = run.make_workspace(numbers, motion)
        run.load_loop(law).march(
            numbers,
            np.arange(35),
            motion,
            part,
            1,
            np.zeros((35, 1, 4)),
            np.zeros(35, np.int64),
            *workspace,
        )
        sine = table[0, k % steps]
        pull = run.law_state(law, motion, "FRICTION") if law in FLOWS else motion[:, Row.MEMORY]
        want = (
            some.output_gain
            * (
                some.drive * sine
                - some.damping * motion[:, Row.SPEED]
                - some.stiffness * motion[:, Row.SLIDE]
                - pull
            )
            + some.base_gain * sine
        )
        np.testing.assert_allclose(found[:, k], want, rtol=1e-9, atol=1e-12)


@pytest.mark.parametrize("steps", [96, 192])
def test_exact_a_set_of_elements_loses_what_masing_says(steps):
    """Energy of a cycle that repeats: 4 k y (A - y) of each element that yields, y < A, half the range of the slide."""
    some = cases("table", 60)
    found = run.march("table", some._replace(damping=0.05 * np.ones(60)), 300, 2, steps)
    settled = np.flatnonzero(found.n_before + found.n_observed < 300)
    half = np.ptp(found.history[:, -1, :2], axis=1) / 2
    lost = (
        some.kinetic
        * (found.motion[:, Row.SLIP_PATH] - found.observed_start[:, Row.SLIP_PATH])
        / found.n_observed
    )
    # of each yield its place, and the force up to it
    table = some.law[:, 3 : 3 + rows.PART_STARTS].reshape(60, -1, rows.N_COLUMNS)
    y, force = (
        scale[:, None] * part
        for scale, part in (
            (some.yield_length, table[:, 1:, 0]),
            (some.spring * some.yield_length, np.diff(table[:, :, 1])),
        )
    )
    want = np.sum(np.where(force > 0, 4 * force * np.maximum(half[:, None] - y, 0.0), 0.0), axis=1)
    assert settled.size > 30
    np.testing.assert_allclose(
        lost[settled], want[settled], rtol=1e-3 if steps == 96 else 3e-4, atol=1e-9
    )
