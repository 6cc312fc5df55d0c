"""For all tests: `rayscope` is importable, whatever the checkout is called and whether or not it is installed.

Tests of the core import `rayscope.core`. Tests of the add-on import `bl_ext.user_default.rayscope.core`, the name under which Blender loads it
(addon/conftest.py sees to that): the two are different modules, so a test must use one of them only.
"""
import importlib.util
import os
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent

# What the core keeps for the user (the calibration) is kept here for as long as the tests run, by those that they start too.
cache = tempfile.TemporaryDirectory(prefix="rayscope-cache-")
os.environ["XDG_CACHE_HOME"] = cache.name

if os.environ.get("RAYSCOPE_WITHOUT_BPY"):  # the core must work where there is no Blender: an import of these fails
    sys.modules.update(dict.fromkeys(["bpy", "bpy_extras", "mathutils", "gpu", "bl_ext"]))

if importlib.util.find_spec("rayscope") is None:  # Blender's own Python: there is nothing installed
    spec = importlib.util.spec_from_file_location("rayscope", ROOT / "__init__.py", submodule_search_locations=[str(ROOT)])
    sys.modules["rayscope"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(sys.modules["rayscope"])
