"""The examples in the docstrings of the public functions run and print what the docstrings say."""

import doctest
import inspect

import pytest

import patchfem as pf
from patchfem import api

SECTIONS = ("Parameters", "Returns", "Raises", "Examples")
# functions without a return value
WITHOUT_RETURN = {"view"}
FUNCTIONS = {
    name: getattr(api, name) for name in api.__all__ if inspect.isfunction(getattr(api, name))
} | {f"plot.{name}": getattr(pf.plot, name) for name in ("sweep", "backbone")}
CLASSES = {name: getattr(api, name) for name in ("Measures", "Plots", "Result")}
METHODS = {"Result.save": api.Result.save, "Result.to_pyvista": api.Result.to_pyvista}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_always_public_functions_have_numpydoc_sections(name):
    """The docstring of every public function has sections for all parameters, the result and the errors."""
    text = inspect.getdoc(FUNCTIONS[name])
    wanted = [one for one in SECTIONS if one != "Returns" or name not in WITHOUT_RETURN]
    assert [one for one in wanted if f"\n{one}\n{'-' * len(one)}\n" not in text] == []
    described = text.partition("Parameters\n")[2].partition("Raises\n")[0]
    for parameter in inspect.signature(FUNCTIONS[name]).parameters.values():
        stars = {parameter.VAR_POSITIONAL: "*", parameter.VAR_KEYWORD: "**"}
        spelling = stars.get(parameter.kind, "") + parameter.name
        assert f"\n{spelling} : " in described or f"\n{spelling}\n" in described, spelling


@pytest.mark.parametrize("name", FUNCTIONS | CLASSES | METHODS)
def test_exact_docstring_examples_run(name, tmp_path, monkeypatch):
    """The examples in the docstrings of the public functions print the documented output."""
    monkeypatch.chdir(tmp_path)
    subject = (FUNCTIONS | CLASSES | METHODS)[name]
    example = doctest.DocTestParser().get_doctest(inspect.getdoc(subject), {}, name, None, None)
    assert example.examples
    printed = []
    runner = doctest.DocTestRunner()
    runner.run(example, out=printed.append)
    assert runner.failures == 0, "".join(printed)


def test_refuses_example_with_wrong_output():
    """The check fails for an example whose documented output is wrong."""
    runner = doctest.DocTestRunner()
    parser = doctest.DocTestParser()
    runner.run(parser.get_doctest(">>> 1 + 1\n3\n", {}, "a", None, None), out=lambda text: None)
    assert runner.failures == 1
