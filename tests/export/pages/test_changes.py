"""What changes first as a swept key grows: places that are known beforehand, bars that hide a change, no change."""

import numpy as np
import pytest
from page_data import own_part

from patchfem.export.pages import changes as module
from patchfem.export.pages.changes import changes
from patchfem.export.pages.sweep import page

TILT = [0.05, 0.1, 0.2, 0.5, 1.0]


def key(values=TILT, name="contact.tilt.angle", unit="mrad", words=False) -> dict:
    return {"name": name, "values": np.array(values, float), "texts": [f"{one:g} {unit}" for one in values],
            "words": words}


def said(fraction, errors=0.0, outcome=None, **more) -> str:
    measures = {"contact_fraction": (np.array(fraction, float), np.zeros(len(fraction)) + errors)}
    return changes([key()], measures | more, outcome or ["done"] * len(fraction))


def test_exact_the_first_case_below_one_and_the_last_before_it():
    assert said([1, 1, 0.9, 0.6, 0.3]) == \
        "As contact.tilt.angle grows: from 0.2 mrad on (not yet at 0.1) only part of the length is in contact."
    assert said([0.5, 1, 1, 1, 1]) == \
        "As contact.tilt.angle grows: from 0.1 mrad on (not yet at 0.05) the whole length is in contact."


def test_exact_a_case_that_its_error_leaves_open_is_neither():
    """0.99 with an error of 0.02 may be 1, and is no longer 1 for sure: both sides are named without it."""
    assert said([1, 1, 0.99, 0.6, 0.3], 0.02) == \
        "As contact.tilt.angle grows: from 0.5 mrad on (not yet at 0.1) only part of the length is in contact."


@pytest.mark.parametrize("fraction, errors", [([1, 1, 1, 1, 1], 0.0), ([1, 1, 0.99, 0.98, 0.99], 0.05),
                                              ([0.5, 0.4, 0.3, 0.2, 0.1], 0.0), ([np.nan] * 5, 0.0)])
def test_exact_nothing_where_nothing_changes_beyond_the_errors(fraction, errors):
    assert said(fraction, errors) == ""


def test_exact_a_change_that_does_not_stay_is_first_at_its_place():
    assert said([1, 1, 0.9, 1, 0.3]) == \
        "As contact.tilt.angle grows: first at 0.2 mrad (not yet at 0.1) only part of the length is in contact."


def test_exact_the_order_of_the_cases_does_not_count():
    """Cases of a file come in any order; `as a key grows` is by its size."""
    turned = [3, 0, 4, 2, 1]
    fraction = np.array([1, 1, 0.9, 0.6, 0.3])[turned]
    one = key(np.array(TILT)[turned])
    measures = {"contact_fraction": (fraction, np.zeros(5))}
    assert changes([one], measures, ["done"] * 5, grid=False) == said([1, 1, 0.9, 0.6, 0.3])


def test_exact_slip_is_told_once_by_what_says_most():
    zero, slip = np.zeros(5), np.array([0, 0, 1e-9, 2e-6, 3e-6])
    outcome = ["stuck", "stuck", "stuck", "steady", "grows"]
    assert said([1] * 5, outcome=outcome, slip_amplitude=(slip, zero)) == \
        ("As contact.tilt.angle grows: from 0.2 mrad on (not yet at 0.1) slip begins; first at 0.5 mrad (not yet "
         "at 0.2) the interface slips as a whole; from 1 mrad on (not yet at 0.5) the motion grows.")
    outcome[2] = "steady"
    stick = np.array([1, 1, 0.5, 0.4, 0.3]), zero
    assert said([1] * 5, outcome=outcome, slip_amplitude=(slip, zero), stick_fraction=stick) == \
        ("As contact.tilt.angle grows: first at 0.2 mrad (not yet at 0.1) the interface slips as a whole; from "
         "1 mrad on (not yet at 0.5) the motion grows.")


def test_exact_that_slip_ends_is_told_once():
    stick = np.array([0.5, 0.8, 1, 1, 1]), np.zeros(5)
    assert said([1] * 5, outcome=["steady", "steady", "stuck", "stuck", "stuck"], stick_fraction=stick) == \
        "As contact.tilt.angle grows: from 0.2 mrad on (not yet at 0.1) the whole interface sticks."


def test_exact_failed_cases_are_passed_over():
    fraction = [1, np.nan, 0.9, 0.6, 0.3]
    assert said(fraction, outcome=["done", "failed", "done", "done", "done"]) == \
        "As contact.tilt.angle grows: from 0.2 mrad on (not yet at 0.05) only part of the length is in contact."


def test_exact_another_key_says_where_it_comes_first_and_last():
    tilt, load = (grid.ravel() for grid in np.meshgrid(TILT, [10.0, 20.0, 40.0], indexing="ij"))
    keys = [key(tilt), key(load, "normal.load", "N")]
    outcome = ["done"] * 15

    def found(limit) -> str:
        return changes(keys, {"contact_fraction": (np.where(tilt > limit, 0.5, 1.0), np.zeros(15))}, outcome)

    start = "As contact.tilt.angle grows: from "
    assert found(load / 45) == (start + "0.5 mrad on (not yet at 0.2) with normal.load 10 N, from 1 mrad on "
                                "with 40 N, only part of the length is in contact.")
    assert found(0.15) == start + "0.2 mrad on (not yet at 0.1) only part of the length is in contact."
    assert found(np.where(load > 15, 2.0, 0.15)) == (start + "0.2 mrad on (not yet at 0.1) with normal.load 10 N "
                                                     "only part of the length is in contact.")
    some = "for 2 of 3 values of normal.load, only part of the length is in contact."
    assert found(np.where(load > 25, 2.0, 0.15)) == start + f"0.2 mrad on (not yet at 0.1), {some}"
    assert found(np.where(load > 25, 2.0, load / 80)) == start + f"0.2 to 0.5 mrad on (not yet at 0.1 and 0.2), {some}"


def test_exact_of_more_keys_only_the_combinations_are_counted():
    tilt, load, friction = (grid.ravel() for grid in np.meshgrid(TILT, [10.0, 20.0, 40.0], [0.3, 0.6], indexing="ij"))
    keys = [key(tilt), key(load, "normal.load", "N"), key(friction, "friction.static", "")]

    def found(limit) -> str:
        return changes(keys, {"contact_fraction": (np.where(tilt > limit, 0.5, 1.0), np.zeros(30))}, ["done"] * 30)

    start = "As contact.tilt.angle grows: from "
    assert found(0.15) == start + "0.2 mrad on (not yet at 0.1) only part of the length is in contact."
    assert found(load * friction / 27) == (start + "0.2 to 1 mrad on (not yet at 0.1 and 0.5), depending on the other "
                                           "2 keys, only part of the length is in contact.")
    assert found(np.where(load > 25, 2.0, load * friction / 27)) == (
        start + "0.2 to 0.5 mrad on (not yet at 0.1 and 0.2), in 4 of 6 combinations of the other 2 keys, only part of "
        "the length is in contact.")
    assert found(np.where((load > 15) | (friction > 0.5), 2.0, 0.15)) == (
        start + "0.2 mrad on (not yet at 0.1), in 1 of 6 combinations of the other 2 keys, only part of the length "
        "is in contact.")


@pytest.mark.parametrize("others", [1, 2, 3])
def test_always_forty_words_are_enough(others, monkeypatch):
    """What comes later gives way to what comes first, which is always told."""
    bound, cut = module.WORDS, 0
    for seed in range(8):
        dice = np.random.default_rng(seed)
        tilt, *rest = (grid.ravel() for grid in np.meshgrid(TILT, *[[1.0, 2.0, 4.0]] * others, indexing="ij"))
        keys = [key(tilt), *(key(one, f"table.key_{number}", "kN") for number, one in enumerate(rest))]
        limits = [TILT[0] * dice.uniform(1, 2) ** sum(rest) * dice.uniform(1, 5) for _ in range(3)]
        measures = {name: (np.where(tilt > limit, 0.5, 1.0), np.zeros(tilt.size))
                    for name, limit in zip(("contact_fraction", "stick_fraction"), limits)}
        measures["slip_amplitude"] = np.where(tilt > limits[2], 1e-6, 0.0), np.zeros(tilt.size)
        texts = []
        for words in (bound, 10**6):
            monkeypatch.setattr(module, "WORDS", words)
            texts.append(changes(keys, measures, ["done"] * tilt.size))
        short, whole = texts
        assert 5 < len(short.split()) <= 40 and (short == whole) == (len(whole.split()) <= 40)
        assert short.split(" (not yet")[0] == whole.split(" (not yet")[0]
        cut += short != whole
    assert cut


def test_exact_values_have_the_digits_that_their_spacing_resolves():
    """A range wrote them; what a person wrote stays as it is."""
    wide, close = np.geomspace(2, 200, 5), np.linspace(1, 1.004, 5)
    for values, at, before in ((wide, "20", "6.3"), (wide * 1e-3, "0.02", "0.0063"), (close / 3, "0.334", "0.33367"),
                               (np.array([1, 3.14159, 9.87654, 20, 30]), "9.87654", "3.14159")):
        one = key() | {"values": values * 1e-6, "texts": [f"{value!r} urad" for value in values.tolist()]}
        text = changes([one], {"contact_fraction": (np.array([1, 1, 0.9, 0.6, 0.3]), np.zeros(5))}, ["done"] * 5)
        assert text == (f"As contact.tilt.angle grows: from {at} urad on (not yet at {before}) only part of the "
                        "length is in contact.")


def test_exact_a_unit_stands_with_both_values_where_it_is_not_the_same():
    one = key() | {"texts": ["50 urad", "100 urad", "0.2 mrad", "0.5 mrad", "1 mrad"]}
    text = changes([one], {"contact_fraction": (np.array([1, 1, 0.9, 0.6, 0.3]), np.zeros(5))}, ["done"] * 5)
    assert "from 0.2 mrad on (not yet at 100 urad) only" in text


def test_exact_words_do_not_grow_and_draws_have_no_lines():
    measures = {"contact_fraction": (np.array([1, 1, 0.9, 0.6, 0.3]), np.zeros(5))}
    assert changes([key(words=True)], measures, ["done"] * 5) == ""
    assert changes([key(), key(name="normal.load")], measures, ["done"] * 5, grid=False) == ""


def test_exact_the_page_says_it_as_text(table):
    """The last case, of the largest tilt and load, grows."""
    want = "As contact.tilt.angle grows: from 1 mrad on (not yet at 0.1) with normal.load 40 N the motion grows."
    assert want in own_part(page(table))
    table["keys"][0]["name"] = "<b>"
    assert "As &lt;b&gt; grows: " in own_part(page(table))


def test_always_many_cases_are_read_at_once():
    """A second would be felt after a sweep of 1e5 cases."""
    from time import process_time

    many = 100_000
    values = np.linspace(1, 2, many)
    one = {"name": "x", "values": values, "texts": [f"{value!r} N" for value in values.tolist()]}
    begin = process_time()
    text = changes([one | {"words": False}], {"stick_fraction": (2.1 - values, np.zeros(many))}, ["steady"] * many)
    assert "from 1.1 N on (not yet at 1.09999) the interface slips" in text and process_time() - begin < 1
