"""Structures that are handed in: right ones pass, wrong ones are told where they are wrong."""

import json
import textwrap

import pytest
from rayscope.core.errors import ParameterError
from rayscope.core.lab import check
from rayscope.core.command import main

pytestmark = pytest.mark.slow

#: The example in the documentation of `check`, as a student would copy it.
EXAMPLE = textwrap.dedent(check.__doc__.split("::\n", 1)[1].split("\nWhat its methods", 1)[0])

FAST = """
import numpy as np
from rayscope.core.fast.structure import Structure

class All(Structure):
    def build(self, progress):
        pass

    def traverse(self, rays, query):
        ray = np.repeat(np.arange(rays.n), self.primitives.n)
        query.test(ray, np.tile(np.arange(self.primitives.n), rays.n))
"""


def run(tmp_path, source, monkeypatch=None, names=("friendly", "many identical", "closed mesh 1e8"), **more):
    path = tmp_path / "mine.py"
    path.write_text(source)
    if monkeypatch is not None:
        some = [case for case in check.cases.cases() if case.name in names]
        monkeypatch.setattr(check.cases, "cases", lambda: some)
    [(structure, core)] = check.load(path)
    return check.check(structure, core, path, **{"seconds": 600, **more})   # however busy the machine is


@pytest.mark.parametrize("source, core", [(EXAMPLE, "pure"), (FAST, "fast")])
def test_what_is_right_passes_everything(tmp_path, source, core):
    result = run(tmp_path, source)
    assert result["core"] == core and not result["failed"] and len(result["rows"]) > 30 and not result["first"]
    yours, brute = result["work"]["yours"], result["work"]["brute"]
    assert yours["N_IT"] == brute["N_IT"] if core == "fast" else yours["N_IT"] < brute["N_IT"]
    assert result["name"] in check.text([result])


WRONG = {
    "lost": (EXAMPLE.replace("order[:middle], order[middle:]", "order[:middle], order[middle + 1:]"), "wrong", "brute force primitive"),
    # The first half that has a hit ends the walk: the nearer hit may be in the other.
    "stops too early": (EXAMPLE.replace("                query.test(item)", "                query.test(item)\n            if query.t < query.ray.t_max:\n                return")
                        .replace("order[:middle], order[middle:]", "order[middle:], order[:middle]"), "wrong", "closest found primitive"),
    "shadow": (EXAMPLE + "\n    def occluded_ray(self, ray, watch=None):\n        return False\n", "shadow", "occluded said False"),
}


@pytest.mark.parametrize("name", list(WRONG))
def test_what_is_wrong_is_told(tmp_path, monkeypatch, name):
    source, column, words = WRONG[name]
    result = run(tmp_path, source, monkeypatch)
    assert result["failed"] and sum(row[column] for row in result["rows"]) > 0 and not result["work"]
    assert words in result["first"] and result["first"].split(":")[0] in {row["case"] for row in result["rows"]}
    assert "differs" in check.text([result])


def test_an_error_names_the_line(tmp_path, monkeypatch):
    source = EXAMPLE.replace("                query.test(item)", "                query.test(item // 0)")
    line = next(k for k, text in enumerate(source.splitlines(), 1) if "// 0" in text)
    result = run(tmp_path, source, monkeypatch)
    assert {row["verdict"] for row in result["rows"]} == {"error"} and f"line {line}, in walk: ZeroDivisionError" in result["first"]


NONE = """
from rayscope.core.{core}.structure import Structure

class Mine(Structure):
    {body}
"""


@pytest.mark.parametrize("core, body, words", [
    ("pure", "def walk(self, query): pass", "it has no method build(self, progress)"),
    ("pure", "def build(self, progress): pass", "it has no method walk(self, query)"),
    ("fast", "def build(self, progress): pass", "it has no method traverse(self, rays, query)"),
    ("pure", "def build(self): pass", "compare its methods with build(self, progress) and walk(self, query)"),
    ("fast", "build = lambda self, progress: None; traverse = lambda self, query: None", "traverse(self, rays, query)"),
    # What ends the program must not pass for a success.
    ("pure", "build = lambda self, progress: None; walk = lambda self, query: exit(0)", "SystemExit"),
])
def test_methods_that_are_missing_or_other_than_they_should_be(tmp_path, monkeypatch, core, body, words):
    result = run(tmp_path, NONE.format(core=core, body=body), monkeypatch)
    assert result["failed"] and words in result["first"]


def test_parameters_that_are_none(tmp_path, monkeypatch):
    with pytest.raises(ParameterError, match="Mine.PARAMETERS is a tuple"):
        run(tmp_path, NONE.format(core="pure", body="PARAMETERS = 3"), monkeypatch)


def test_a_walk_without_end_is_stopped(tmp_path, monkeypatch):
    source = EXAMPLE.replace("        for half in self.halves:", "        while True:\n            pass\n        for half in self.halves:")
    result = run(tmp_path, source, monkeypatch, seconds=0.5)
    assert [row["verdict"] for row in result["rows"]] == ["stopped"] and "had not ended after 0.5 s" in result["first"]


@pytest.mark.parametrize("source, words", [("import", "line 1"), ("x = 1", "no class"), ("raise KeyError('a')", "line 1, in <module>: KeyError"),
                                           ("raise SystemExit(0)", "line 1, in <module>: SystemExit"), (None, "no such file")])
def test_files_without_a_structure(tmp_path, source, words):
    path = tmp_path / "mine.py"
    if source is not None:
        path.write_text(source)
    with pytest.raises(ParameterError, match="mine.py") as caught:
        check.load(path)
    assert words in str(caught.value)
    assert main(["check", str(path)]) == 2


def test_the_verb(tmp_path, capsys, monkeypatch):
    (tmp_path / "mine.py").write_text(EXAMPLE)
    (tmp_path / "other.py").write_text("print('hello')\n" + WRONG["lost"][0])
    some = check.cases.cases()[:1]
    monkeypatch.setattr(check.cases, "cases", lambda: some)
    assert main(["check", str(tmp_path / "mine.py")]) == 0
    assert "2 of 2 cases as brute force" in capsys.readouterr().out
    assert main(["check", str(tmp_path / "other.py"), "--json"]) == 1
    out, err = capsys.readouterr()
    assert json.loads(out)["failed"] is True and "hello" in err, "what it prints is no part of the result"
