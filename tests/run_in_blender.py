"""pytest inside Blender: blender -b --factory-startup --python-exit-code 1 --python tests/run_in_blender.py -- tests/addon -q

TEST_SITE names folders with what Blender's Python lacks (pytest, hypothesis, embreex).
"""
import os
import sys

sys.path[:0] = [path for path in os.environ.get("TEST_SITE", "").split(os.pathsep) if path]
import pytest

code = int(pytest.main(sys.argv[sys.argv.index("--") + 1 :]))
sys.stdout.flush()
sys.stderr.flush()
sys.exit(code)  # becomes Blender's exit code
