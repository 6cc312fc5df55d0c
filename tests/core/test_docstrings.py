"""What `rayscope.core` offers tells of every parameter what it is."""

import inspect
import re
from functools import cached_property

import pytest
from rayscope import core
from rayscope.core import solids
from rayscope.core.fast.structure import Structure as Fast
from rayscope.core.pure.structure import Structure as Pure


def public():
    """Names and things: what is exported, the makers of solids, and what a structure of one's own is made of."""
    for name in core.__all__:
        yield from members(name, getattr(core, name)) if name != "solids" else ()
    for name, thing in vars(solids).items():
        if inspect.isfunction(thing) and thing.__module__ == solids.__name__ and not name.startswith("_"):
            yield f"solids.{name}", thing
    for core_name, structure in (("pure", Pure), ("fast", Fast)):
        for name in ("build", "walk", "traverse", "closest", "occluded", "cells"):
            if hasattr(structure, name):
                yield f"{core_name}.{name}", getattr(structure, name)


def members(name, thing):
    """A thing; of a class, its public methods too."""
    yield name, thing
    if inspect.isclass(thing):
        for own, method in vars(thing).items():
            if own.startswith("_") or not (inspect.isroutine(method) or isinstance(method, property)):
                continue
            if isinstance(method, (property, cached_property)):
                yield f"{name}.{own}", getattr(method, "fget", None) or method.func
            else:
                yield f"{name}.{own}", getattr(thing, own)


def told(doc):
    """Names in the sections Parameters and Attributes."""
    names = set()
    for section in re.findall(r"^(?:Parameters|Attributes)\n-+\n(.*?)(?=^\S[^\n]*\n-+\n|\Z)", doc, re.M | re.S):
        for line in section.splitlines():
            if line and not line.startswith(" "):
                names |= {name.strip().lstrip("*") for name in line.split(" : ")[0].split(",")}
    return names


PUBLIC = dict(public())


@pytest.mark.parametrize("name", PUBLIC)
def test_every_parameter_is_told(name):
    thing = PUBLIC[name]
    doc = inspect.getdoc(thing)
    assert doc, "no docstring"
    if not (inspect.isclass(thing) and issubclass(thing, Exception)):
        names = [p for p in inspect.signature(thing).parameters if p not in ("self", "cls")]
        assert set(names) <= told(doc)


def test_a_gap_would_be_seen():
    assert told("x\n\nParameters\n----------\na, b : int\n    c : no\n*d\n\nReturns\n-------\ne : int\n") == {"a", "b", "d"}
    assert len(PUBLIC) > 50
