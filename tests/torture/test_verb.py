"""The hidden verb: what it refuses, what it says of a fault, how it ends."""

import pytest
from command_line import cli

from patchfem.torture import driver


@pytest.fixture(autouse=True)
def cold(monkeypatch):
    monkeypatch.setattr(driver, "warm", lambda command, place: None)


def test_always_out_of_the_help():
    assert cli("--help").out.count("doctor") and "torture" not in cli("--help").out


@pytest.mark.parametrize("words, said", [
    (("--campaign", "gramar"), "one of grammar, bytes"), (("--share", "0"), "above 0"), (("--share", "2"), "above 0"),
    (("--only", "3"), "in one --campaign"), (("--campaign", "bytes", "--only", "-1"), "from 0 on")])
def test_refuses_in_words(words, said):
    answer = cli("torture", *words)
    assert answer.code == 2 and said in answer.err


def test_always_a_fault_is_made_again_by_its_line(monkeypatch):
    monkeypatch.setattr(driver, "alone", lambda work, trial, clock: "exit code 1: oh [patchfem check scene.toml]")
    answer = cli("torture", "--campaign", "grammar", "--share", "0.0003", "--seed", "7")
    assert answer.code == 3
    assert "grammar 1: exit code 1: oh" in answer.err
    assert "  again: patchfem torture --campaign grammar --seed 7 --only 1" in answer.err
    assert answer.out.splitlines()[1].split()[:3] == ["grammar", "2", "2"]


def test_exact_zero_where_all_held(monkeypatch):
    monkeypatch.setattr(driver, "alone", lambda work, trial, clock: "")
    answer = cli("torture", "--share", "1e-9")
    assert answer.code == 0 and not answer.err
    assert [line.split()[0] for line in answer.out.splitlines()[1:]] == list(driver.CAMPAIGNS)
