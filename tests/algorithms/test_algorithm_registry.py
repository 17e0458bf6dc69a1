"""Algorithms by name, the built-in ones and third parties'."""

from importlib.metadata import EntryPoint

import pytest

from algorithms import registry
from algorithms.registry import ENTRY_POINT_GROUP, BrokenAlgorithmError, UnknownAlgorithmError, load, names


@pytest.fixture
def plug_ins(monkeypatch):
    """Pretend that other packages registered these algorithms."""

    def register(**values):
        entries = [EntryPoint(name, value, ENTRY_POINT_GROUP) for name, value in values.items()]
        monkeypatch.setattr(registry, "entry_points", lambda group: entries if group == ENTRY_POINT_GROUP else [])

    return register


def test_built_in_algorithms_are_listed_in_the_order_of_the_paper():
    assert names()[:8] == ["mupso", "spso", "woa", "gwo", "goa", "de", "random-search", "cma-es"]


@pytest.mark.parametrize("name", names())
def test_a_class_is_found_under_its_own_name(name):
    assert load(name).name == name


def test_an_unknown_name_is_answered_with_the_nearest_one():
    with pytest.raises(UnknownAlgorithmError, match=r"unknown algorithm 'mupos': did you mean 'mupso'\?"):
        load("mupos")


def test_a_name_that_is_near_to_nothing_is_answered_with_all_names():
    with pytest.raises(UnknownAlgorithmError, match="choose one of mupso, spso, woa"):
        load("tabu")


def test_a_plug_in_is_listed_and_loaded(plug_ins):
    plug_ins(mine="algorithms.gwo:GWO")
    assert names()[-1] == "mine"
    assert load("mine").name == "gwo"


@pytest.mark.parametrize("value", ["no_such_module_anywhere:X", "algorithms.gwo:Missing"])
def test_a_broken_plug_in_is_named_and_troubles_no_other(plug_ins, value):
    plug_ins(broken=value)
    assert "broken" in names()
    assert load("spso").name == "spso"
    with pytest.raises(BrokenAlgorithmError, match=f"algorithm 'broken' \\({value}\\) cannot be imported"):
        load("broken")


def test_a_name_that_is_registered_twice_is_refused(plug_ins):
    plug_ins(gwo="algorithms.woa:WOA")
    assert names().count("gwo") == 1
    with pytest.raises(BrokenAlgorithmError, match=r"registered more than once: algorithms\.gwo:GWO and"):
        load("gwo")
