"""Errors of the harmonic balance of random rigs cover results at a much smaller tolerance, and are
not too large."""

import numpy as np

import patchfem as pf

PLASTIC = 'law = "elastic-plastic"\nbond_length = "{:.4g} um"'
LAWS = {
    "tanh": 'law = "tanh"\nreference_speed = "{:.4g} mm/s"',
    "nonlocal": 'law = "nonlocal"\nbond_length = "{:.4g} um"',
    "bouc-wen": 'law = "bouc-wen"\nstiffness = "{:.4g} N/um"',
    "stiffening": PLASTIC,
    "interlock": PLASTIC,
    "lugre": 'law = "lugre"\nstiffness = "{:.4g} N/um"\nkinetic = 0.25\nstribeck_speed = "10 mm/s"',
}
SPRING_TABLES = {
    "stiffening": '[structure.stiffening]\ncubic = "1e12 N/m^3"\n',
    "interlock": '[structure.bonded]\nstiffness = "1e6 N/m"\nwavelength = "40 um"\n',
}
SECOND = (
    '[[structure.mode]]\nname = "second"\nfrequency = "{:.4g} Hz"\ndamping = 0.01\nslide = -0.6\n'
)
MAX_SHARP_RATIO = 5.0  # Largest ratio of stated to true error of a sharp error.
SMALL_ERROR = 1e-8  # Relative error below which an error counts as sharp anyway.
IGNORED_MEASURES = (
    "energy_balance",
    "work_check",
    "normal_load",
    "drift_per_cycle",
    "slip_start_phase",
    "stick_fraction",
)


def draw_rig(law: str, seed: int) -> str:
    """Return a scene of one or two modes under a sine."""
    rng = np.random.default_rng(seed)
    number = 10 ** (rng.uniform(0.3, 2) if law == "tanh" else rng.uniform(-0.3, 1.3))
    modes = (
        f'[[structure.mode]]\nname = "first"\nfrequency = "143 Hz"\ndamping = {rng.uniform(0.003, 0.05):.4g}\n'
        "slide = 1.0\n" + (SECOND.format(rng.uniform(300, 900)) if rng.random() < 0.4 else "")
    )
    return (
        f'[normal]\nload = "116 N"\n[friction]\nstatic = 0.3\n{LAWS[law].format(number)}\n[structure]\n'
        f'moving_mass = "0.884 kg"\n{modes}{SPRING_TABLES.get(law, "")}[drive]\nkind = "base"\nfrequency = "'
        f'{rng.uniform(60, 300):.5g} Hz"\nacceleration = "{10 ** rng.uniform(0.3, 1.3):.4g} g"\ncycles = 30\n'
        '[accuracy]\nmethod = "harmonic"\n'
    )


def error_rows(text: str) -> list:
    """Return rows (error, true error, error of the reference, value) of the measures of a scene."""
    measures = pf.run(text).measures
    fine = pf.run(text, **{"accuracy.tolerance": "1e-5"}).measures
    pairs = [
        (m, fine[name])
        for name, m in measures.items()
        if name in fine and name not in IGNORED_MEASURES
    ]
    return [
        (m.error, abs(m.value - t.value), t.error, abs(m.value))
        for m, t in pairs
        if None not in (m.value, m.error, t.value)
    ]


def test_always_errors_of_balance_cover_and_are_sharp():
    """For a rig of each law, 97 % of the errors cover the reference, and 70 % are at most five
    times the true error, where this is known."""
    rows = np.array(
        [row for seed, law in enumerate(LAWS, 400) for row in error_rows(draw_rig(law, seed))]
    )
    error, true_error, reference_error, value = rows.T
    assert np.mean(true_error <= error + reference_error) >= 0.97
    is_small = error <= SMALL_ERROR * value
    is_known = true_error > 2 * reference_error
    assert np.mean((is_small | (error <= MAX_SHARP_RATIO * true_error))[is_small | is_known]) >= 0.7
