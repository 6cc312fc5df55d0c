"""The extension as Blender sees it: valid, built into a zip, installed from it, and leaving nothing behind when disabled."""
import os
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import bpy
import pytest

ROOT = Path(__file__).resolve().parents[2]
SCRIPT = Path(__file__).with_name("install_and_toggle.py")


def extension_command(*arguments):
    """Blender's own `extension` command; the bpy module has no command line, but ships the script behind it."""
    if bpy.app.module:
        script = Path(bpy.utils.system_resource("SCRIPTS"), "addons_core", "bl_pkg", "cli", "blender_ext.py")
        command = [sys.executable, script]
    else:
        command = [bpy.app.binary_path, "--command", "extension"]
    return subprocess.run([*command, *arguments], text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)


@pytest.fixture(scope="module")
def zip_file(tmp_path_factory):
    target = tmp_path_factory.mktemp("zip") / "rayscope.zip"
    done = extension_command("build", "--source-dir", str(ROOT), "--output-filepath", str(target))
    assert done.returncode == 0 and target.exists(), done.stdout
    return target


def test_the_checkout_is_valid():
    done = extension_command("validate", str(ROOT))
    assert done.returncode == 0, done.stdout


def test_the_checked_in_manifest_lists_no_wheels():
    assert "wheels" not in tomllib.loads((ROOT / "blender_manifest.toml").read_text())


def test_manifest_and_package_have_the_same_version():
    manifest = tomllib.loads((ROOT / "blender_manifest.toml").read_text())
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())
    assert manifest["version"] == project["project"]["version"]


def test_the_zip_is_valid_and_holds_what_is_needed_only(zip_file):
    done = extension_command("validate", str(zip_file))
    assert done.returncode == 0, done.stdout
    names = zipfile.ZipFile(zip_file).namelist()
    # No "rayscope/" in front: Blender packs the root's contents.
    assert {"blender_manifest.toml", "__init__.py", "core/__init__.py", "addon/__init__.py", "LICENSE"} <= set(names)
    for name in names:
        top = name.split("/")[0]
        assert not top.startswith(".") and top not in {"tests", "tools", "example_blends", "docs", "dist", "build", "out"}, name
        assert "__pycache__" not in name and not name.endswith(".whl"), name
    assert zip_file.stat().st_size < 2e6


def test_install_enable_disable_and_enable_again(zip_file, tmp_path):
    """In a Blender of its own: here, the zip would be installed over the link to the checkout."""
    if bpy.app.module:
        command = [sys.executable, SCRIPT]
    else:
        command = [bpy.app.binary_path, "-b", "--factory-startup", "--python-exit-code", "1", "--python", SCRIPT]
    environment = {**os.environ, "BLENDER_USER_RESOURCES": str(tmp_path)}
    done = subprocess.run([*command, "--", zip_file], env=environment, text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=600)
    assert done.returncode == 0 and "NOTHING LEFT BEHIND" in done.stdout, done.stdout
