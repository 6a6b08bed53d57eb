"""The counts of tokens and style breaches do not rise, and the checker finds a breach of every rule."""

from collections import Counter
from pathlib import Path

import pytest
from house import (  # fmt: skip
    RULES,
    add_rules,
    border_rules,
    count_sources,
    count_tokens,
    exceeded_counts,
    find_words,
    lower_baseline,
    measure_rules,
    offered_names,
    owner_rules,
    parse_source,
    quoted_name_rules,
    read_baseline,
    row_rules,
    style_rules,
    write_baseline,
)

CLEAN = '''"""A module without a breach."""
MAX_STEPS = 5  # the largest number of steps for which the result is exact

def solve_steps(matrix, load, *, is_linear=False):
    """Solve a system of equations.

    Parameters
    ----------
    matrix, load : arrays
        Both of n rows.
    is_linear : bool
    """
    low, high = limits(matrix)
    return [row * load for row in matrix if row], low
'''
PLANTED = {
    "N1": "def settled(): pass",
    "N2": "def together(): pass",
    "N3": "def size_of(): pass",
    "N4": "def most(): pass",
    "N5": 'def solve(q):\n    """Solve."""',
    "N6": "MOST = 5",
    "N7": "def solve(*, modes: int): pass",
    "N8": "def solve_twice(): pass",
    "N9": "def solve():\n    found = 1",
    "K1": "force = state[3]",
    "C1": "MAX_A, MAX_B = 1, 2",
    "C2": "MAX_A = 1  # of a length",
    "C4": "\n".join(f"MAX_{k} = {k}" for k in range(13)),
    "D2": 'def solve(first, second, third):\n    """Solve."""',
    "D3": 'def solve():\n    """(force, slip) of a rig."""',
    "D4": 'def solve():\n    """What a rig does."""',
    "D6": 'def solve(modes, *drives):\n    """Solve.\n\n    Parameters\n    ----------\n    mode, drives : int\n    """',
    "D7": 'def solve(rig):\n    """Solve a `rig` as `solve_old` does."""',
    "D5": 'def solve():\n    """Solve a rig that has\n    two masses."""',
    "F1": "def solve():\n    return 1, 2, 3",
    "F2": "def solve(a1, a2, a3, a4, a5, a6, a7): pass",
    "F3": "def solve(is_linear=False): pass",
    "F5": "def solve():\n    return 1 if a else (2 if b else 3)",
    "F6": "def solve():\n    return (1 if a else\n        2)",
    "F7": "def solve():\n    return [x for y in z for x in y]",
    "F8": "def solve():\n    first, second = 1, 2",
    "F9": "def solve():\n    return lambda: 1, [lambda: 2, lambda: 3]",
    "R1": "class Rig(NamedTuple):\n" + "\n".join(f"    field{k}: int" for k in range(9)),
    "M1": "area = values['loop_area']",
    "deep": "from patchfem.contact.gaps import crown",
    "inner": "from patchfem.contact.gaps import curvature",
    "private": "from patchfem import api\napi._check()",
    "monkeypatch": "def test(monkeypatch):\n    monkeypatch.setattr(module, 'name', 1)",
}
OFFERED = frozenset({"patchfem.contact.gaps.crown"})


def broken_rules(text: str) -> set:
    """Return the rules that a text of a module breaks."""
    source = parse_source(text, Path("module.py"))
    found = (
        *style_rules(source),
        *border_rules(source.nodes, OFFERED),
        *measure_rules(source.nodes, frozenset({"loop_area"})),
        *quoted_name_rules(source, find_words([source])),
        *owner_rules(source, Counter({"solve_twice": 2})),
        *row_rules(source.nodes),
    )
    return {rule for rule, _, _ in found}


def test_always_counts_are_within_baseline():
    """No count of tokens or of style breaches exceeds the baseline in house.toml."""
    assert not (messages := exceeded_counts(count_sources(), read_baseline())), "\n".join(messages)


def test_exact_clean_module_breaks_no_rule():
    """A module without breaches passes, and there is an example of a breach for every rule."""
    assert broken_rules(CLEAN) == set()
    assert set(PLANTED) == set(RULES) - {"tokens"}


@pytest.mark.parametrize("rule", PLANTED)
def test_exact_breach_of_each_rule_is_found(rule):
    """The checker finds the breach in the example of each rule, and no other."""
    # a breach of `inner` is a deep import too
    implied = {"deep"} if rule == "inner" else set()
    assert broken_rules(PLANTED[rule]) == {rule} | implied


def test_exact_names_used_by_other_folders_are_offered():
    """The names that a folder offers are those that other folders import or read."""
    root = Path("/checkout")
    modules = {
        "patchfem/contact/gaps.py": "from .edges import closed_length\n",
        "patchfem/contact/edges.py": "",
        "patchfem/runs/patch/press.py": (
            "from ...contact import edges\nfrom ...contact.gaps import crown\nfrom . import ladder\n"
            "edges.find_edges(crown)\n"
        ),
        "patchfem/runs/patch/ladder.py": "",
    }
    sources = [parse_source(text, root / name) for name, text in modules.items()]
    assert offered_names(sources, root) == {
        "patchfem.contact.edges",
        "patchfem.contact.edges.find_edges",
        "patchfem.contact.gaps.crown",
    }


def test_exact_comments_and_docstrings_are_not_counted():
    """Comments and docstrings do not count as tokens."""
    text = (
        '"""A module."""\n\nx = [1]  # a list\n\ndef f():\n    """Return."""\n    return "text"\n'
    )
    assert count_tokens(parse_source(text, Path("module.py"))) == 5 + 5 + 2


def test_refuses_count_above_baseline(tmp_path):
    """A count above the baseline is reported with the file and the line of the new breach."""
    module = tmp_path / "patchfem/contact/gaps.py"
    module.parent.mkdir(parents=True)
    (tmp_path / "tests").mkdir()
    module.write_text(CLEAN + "def settled(): pass\n", "utf-8")
    write_baseline(count_sources(tmp_path).values, tmp_path)
    assert exceeded_counts(count_sources(tmp_path), read_baseline(tmp_path)) == []
    module.write_text(CLEAN + "def settled(): pass\ndef glued(): pass\n", "utf-8")
    tokens, names = exceeded_counts(count_sources(tmp_path), read_baseline(tmp_path))
    assert tokens.startswith("patchfem/contact: tokens ")
    assert "N1 2, allowed 1" in names and f"{module}:{CLEAN.count(chr(10)) + 2}: glued" in names


def test_exact_baseline_is_only_lowered():
    """`--lower` lowers the counts of the baseline and raises none; `--add` adds those of new rules."""

    class Present:
        """Counts of a checkout with one higher and one lower value than the baseline."""

        values = {"patchfem/contact": {"tokens": 90, "N1": 3}}  # noqa: RUF012

    lowered = lower_baseline(Present, {"patchfem/contact": {"tokens": 100, "N1": 2, "N2": 5}})
    assert lowered == {"patchfem/contact": {"tokens": 90, "N1": 2}}
    added = add_rules(Present, {"patchfem/contact": {"tokens": 100}}, ["N1"])
    assert added == {"patchfem/contact": {"tokens": 100, "N1": 3}}
