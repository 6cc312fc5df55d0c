"""Unknown names and bad values are refused with what is possible; every declaration is sane."""
import numpy as np
import pytest
from rayscope.core import ParameterError, Scene, build, technique, techniques
from rayscope.core.parameters import Parameter, resolve

SCENE = Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)])
NUMBERS = (Parameter("size", 2, "How many", low=1, high=10, unit="cells"), Parameter("ratio", 0.5, "How much", low=0.0, high=1.0),
           Parameter("mail", False, "Whether"), Parameter("how", {"pure": "a", "fast": "b"}, "How", choices=("a", "b"), only=(("b", "fast"),)))


def test_unknown_technique_lists_the_known():
    with pytest.raises(ParameterError) as error:
        build(SCENE, "octre")
    assert "did you mean 'octree'" in str(error.value) and all(t.name in str(error.value) for t in techniques())


def test_unknown_core_lists_the_known():
    with pytest.raises(ParameterError, match="pure, fast"):
        build(SCENE, "brute", core="gpu")


@pytest.mark.parametrize("row", techniques(), ids=lambda row: row.name)
@pytest.mark.parametrize("core", ["pure", "fast"])
def test_unknown_parameter_lists_the_known(row, core):
    if core not in row.cores:
        pytest.skip(f"has no core {core}")
    with pytest.raises(ParameterError) as error:
        build(SCENE, row.name, core, no_such_parameter=1)
    assert "no_such_parameter" in str(error.value)
    assert all(p.name in str(error.value) for p in row.parameters)


@pytest.mark.parametrize("row", techniques(), ids=lambda row: row.name)
def test_values_out_of_range_are_refused(row):
    for p in row.parameters:
        bad = ["no such choice"] if p.choices else [p.low - 1, p.high + 1, "x", float("nan"), None] if p.type in (int, float) else ["perhaps"]
        for value in bad:
            with pytest.raises(ParameterError, match=p.name):
                build(SCENE, row.name, row.cores[0], **{p.name: value})


@pytest.mark.parametrize("row", techniques(), ids=lambda row: row.name)
def test_declarations_are_complete(row):
    assert row.label and row.help and row.source and row.cores and set(row.rays) <= {"primary", "secondary", "shadow"}
    names = [p.name for p in row.parameters]
    assert len(names) == len(set(names))
    for p in row.parameters:
        assert p.help and p.type in (bool, int, float, str), p.name
        for core in row.cores:
            default = p.default_in(core)
            assert p.check(default, row.name, core) == default      # the default itself is allowed
            if p.type in (int, float):
                assert p.low is not None and p.high is not None and p.low <= default <= p.high
            if p.type is str:
                assert default in p.choices_in(core)


IDLE = [(row, p) for row in techniques() for p in row.parameters if p.depends]


@pytest.mark.parametrize("row, p", IDLE, ids=lambda value: value.name)
def test_what_depends_on_another_parameter_has_no_effect_without_it(row, p):
    name, wanted = p.depends
    other = next(q for q in row.parameters if q.name == name)
    without = {name: next(c for c in other.choices if c != wanted) if other.choices else other.high // 1000}
    ends = p.choices_in("fast")[:2] if p.choices else (False, True) if p.type is bool else (p.low, min(p.high, 1000 * p.low + 10))
    assert ends[0] != ends[1]
    rng = np.random.default_rng(4)
    scene = Scene.from_triangles(rng.uniform(-1, 1, (300, 3)), np.arange(300).reshape(-1, 3))
    figures = [build(scene, row.name, **without, **{p.name: p.type(end)}).figures for end in ends]
    assert {**figures[0], "T_B": 0} == {**figures[1], "T_B": 0}


@pytest.mark.parametrize("given, value", [({"size": "7"}, 7), ({"size": 7.0}, 7), ({"ratio": 1}, 1.0), ({"mail": "true"}, True),
                                          ({"mail": "off"}, False), ({"mail": 1}, True), ({"how": "a"}, "a")])
def test_values_get_the_parameters_type(given, value):
    result = resolve("test", NUMBERS, given, "fast")[next(iter(given))]
    assert result == value and type(result) is type(value)


@pytest.mark.parametrize("given, words", [({"size": 0}, "between 1 and 10 cells"), ({"size": 2.5}, "whole number"), ({"size": None}, "whole number"),
                                          ({"ratio": float("nan")}, "number"), ({"ratio": float("inf")}, "ratio"), ({"mail": "perhaps"}, "true or false"),
                                          ({"how": "c"}, "a, b"), ({"sise": 1}, "did you mean 'size'")])
def test_bad_values_are_named(given, words):
    with pytest.raises(ParameterError, match=words):
        resolve("test", NUMBERS, given, "fast")


def test_choice_of_one_core_only():
    assert resolve("test", NUMBERS, {}, "pure")["how"] == "a" and resolve("test", NUMBERS, {}, "fast")["how"] == "b"
    with pytest.raises(ParameterError, match="core 'pure'"):
        resolve("test", NUMBERS, {"how": "b"}, "pure")


def test_rows_are_found_by_name():
    assert all(technique(t.name) is t for t in techniques())
    assert len({t.name for t in techniques()}) == len(techniques())
