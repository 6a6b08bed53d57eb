"""Engines are what their records say: one table of what each takes, hooks that exist, and no text that asks a name."""

import ast
from itertools import product
from pathlib import Path

import pytest

import patchfem
from patchfem.effects import LAWS, SINE, WAVEFORMS
from patchfem.runs.rig.engines import AUTOMATIC, ENGINES, FINDERS, function_of
from patchfem.scene.keys.tables import Friction
from patchfem.scene.rules.methods import BESIDE, TAKES, Motion, lacking

HOOKS = ("solve", "cost", "chosen", "refuse", "words", "notes")
PACKAGE = Path(patchfem.__file__).parent
LEVELS = WAVEFORMS["levels"]
OWN = ("runs/bench", "friction/bonds", "scene")  # own methods, sums, tables


def asks_by_name(tree) -> list:
    """Lines of comparisons of something called `engine`, or of a `name`, with the name of an engine."""
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Compare):
            words = {leaf.value for leaf in ast.walk(node) if isinstance(leaf, ast.Constant)}
            asked = {leaf.attr if isinstance(leaf, ast.Attribute) else leaf.id for leaf in ast.walk(node)
                     if isinstance(leaf, ast.Attribute | ast.Name)}
            if words & set(ENGINES) and asked & {"engine", "name"}:
                found.append(node.lineno)
    return found


def test_always_no_text_asks_for_an_engine_by_its_name():
    assert asks_by_name(ast.parse('numerics.engine == "march"')) == [1]
    assert asks_by_name(ast.parse('engine not in ("exact", other)')) == [1]
    for path in PACKAGE.rglob("*.py"):
        if not path.relative_to(PACKAGE).as_posix().startswith(OWN):
            text = path.read_text("utf-8")
            assert "engine" not in text or not asks_by_name(ast.parse(text)), path


def test_always_every_engine_has_a_row_of_what_it_takes():
    assert set(ENGINES) == set(TAKES) and set(AUTOMATIC) <= set(ENGINES.values())
    for one in TAKES.values():
        assert set(one.beside.split()) <= set(BESIDE)
    assert {one.like for one in FINDERS.values()} <= set(ENGINES)


@pytest.mark.parametrize("name", ENGINES)
def test_always_the_functions_of_a_record_exist(name):
    for where in (getattr(ENGINES[name], hook) for hook in HOOKS):
        assert not where or callable(function_of(where))


def motions():
    """Motions of every law with everything that may stand beside it."""
    for law, soft, varies, yaws, spring, waveform in product(
            LAWS, ("", "[contact.shear]"), ("", "with normal.amplitude"), (False, True),
            ("", "[structure.stiffening]", "[normal.grooves]"), (SINE, LEVELS)):
        for count in (1, 2):
            yield Motion([Friction(law=law, static=0.3)] * count, [soft] * count, varies, yaws, spring, waveform)


def reasons(m) -> list:
    """What the engines of method "exact" lack for a Motion."""
    return [lacking(name, m) for name, one in ENGINES.items() if one.method == "exact"]


def test_exact_the_march_takes_all_that_others_lack():
    for m in motions():
        assert lacking("march", m) == ""
        if m.varies or m.spring:
            assert all([*reasons(m), lacking("smooth", m)])


def test_exact_what_has_no_solution_between_events_is_named():
    ep, coulomb, tanh = (Friction(law=law, static=0.3) for law in ("elastic-plastic", "coulomb", "tanh"))
    for laws, soft in (([], ""), ([coulomb], ""), ([coulomb], "[contact.shear]"), ([ep], ""), ([ep], "a holder")):
        assert "" in reasons(Motion(laws, [soft] * len(laws), "", False, "", SINE))
    for m, said in ((Motion([tanh], [""], "", False, "", SINE), "for law 'tanh'"),
                    (Motion([ep], [""], "", True, "", SINE), "with strips that yaw"),
                    (Motion([coulomb], [""], "", True, "", LEVELS), "with strips that yaw and waveform 'levels'"),
                    (Motion([coulomb], [""], "", False, "[normal.grooves]", SINE), "with [normal.grooves]")):
        assert all(reasons(m)) and said in reasons(m)
