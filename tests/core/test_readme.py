"""The README names what there is."""
from pathlib import Path

import pytest
from rayscope.core import techniques
from rayscope.core.command import VERBS

README = (Path(__file__).resolve().parents[2] / "README.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", [row.name for row in techniques()] + list(VERBS))
def test_every_technique_and_verb_has_its_row(name):
    rows = [line.split("|")[1] for line in README.splitlines() if line.startswith("| `")]
    assert any(f"`{name}`" in first for first in rows)


def test_no_row_without_a_technique_or_verb():
    named = {part.strip("` ") for line in README.splitlines() if line.startswith("| `") for part in line.split("|")[1].split(",")}
    assert named <= {row.name for row in techniques()} | set(VERBS)
