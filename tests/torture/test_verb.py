"""The program that runs the campaigns: what it refuses, what it says of a fault, how it ends."""

import pytest
from torture import driver
from torture.__main__ import main


@pytest.fixture(autouse=True)
def cold(monkeypatch):
    monkeypatch.setattr(driver, "warm", lambda command, place: None)


@pytest.mark.parametrize("words, said", [
    (("--campaign", "gramar"), "one of grammar, bytes"), (("--share", "0"), "above 0"), (("--share", "2"), "above 0"),
    (("--only", "3"), "in one --campaign"), (("--campaign", "bytes", "--only", "-1"), "from 0 on")])
def test_refuses_in_words(words, said, capsys):
    with pytest.raises(SystemExit, match="2"):
        main(words)
    assert said in capsys.readouterr().err


def test_always_a_fault_is_made_again_by_its_line(monkeypatch, capsys):
    monkeypatch.setattr(driver, "alone", lambda work, trial, clock: "exit code 1: oh [patchfem check scene.toml]")
    assert main(("--campaign", "grammar", "--share", "0.0003", "--seed", "7")) == 3
    told = capsys.readouterr()
    assert "grammar 1: exit code 1: oh" in told.err
    assert "  again: python tests/support/torture --campaign grammar --seed 7 --only 1" in told.err
    assert told.out.splitlines()[1].split()[:3] == ["grammar", "2", "2"]


def test_exact_zero_where_all_held(monkeypatch, capsys):
    monkeypatch.setattr(driver, "alone", lambda work, trial, clock: "")
    assert main(("--share", "1e-9")) == 0
    told = capsys.readouterr()
    assert not told.err
    assert [line.split()[0] for line in told.out.splitlines()[1:]] == list(driver.CAMPAIGNS)
