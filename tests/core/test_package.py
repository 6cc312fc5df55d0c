"""The package as such: the checkout is `rayscope`, and its core knows nothing of Blender."""
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def test_the_core_runs_where_there_is_no_blender(tmp_path):
    (tmp_path / "rayscope").symlink_to(ROOT, target_is_directory=True)
    code = "import sys; sys.modules.update(bpy=None, mathutils=None, gpu=None); import rayscope.core; print(rayscope.core.__name__)"
    path = os.pathsep.join([str(tmp_path), *sys.path])
    done = subprocess.run([sys.executable, "-c", code], env={**os.environ, "PYTHONPATH": path}, text=True, capture_output=True)
    assert done.stdout.strip() == "rayscope.core", done.stderr


@pytest.mark.parametrize("path", sorted((ROOT / "core").rglob("*.py")), ids=lambda path: str(path.relative_to(ROOT)))
def test_no_file_of_the_core_imports_blender_or_the_addon(path):
    if path.relative_to(ROOT).parts[1] == "peers":  # other people's engines, mathutils' among them
        return
    assert not re.search(r"^\s*(import|from)\s+(bpy|bpy_extras|mathutils|gpu|bmesh|[.\w]*\baddon)\b", path.read_text(encoding="utf-8"), re.MULTILINE)


def test_pure_and_fast_do_not_import_each_other():
    for one, other in (("pure", "fast"), ("fast", "pure")):
        for path in (ROOT / "core" / one).rglob("*.py"):
            assert not re.search(rf"^\s*(import|from)\s+[.\w]*\b{other}\b", path.read_text(encoding="utf-8"), re.MULTILINE), path
