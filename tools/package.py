"""Build the extension into dist/: one plain zip, and per
platform a release zip with the wheels of embreex and matplotlib.

The plain zip runs wherever numpy does, so in every Blender. Blender refuses a zip
with wheels if none of them is for its Python, therefore only release zips hold
wheels, for each Python that a supported Blender has. Versions are those of uv.lock.
"""
import shutil
import subprocess
import sys
import tempfile
import tomllib
import zipfile
from importlib.util import find_spec
from pathlib import Path

from packaging.markers import Marker

ROOT = Path(__file__).resolve().parent.parent
DIST = ROOT / "dist"
WANTED = ["embreex", "matplotlib"]
IN_BLENDER = {"numpy"}  # Blender brings it: a second one would clash
PYTHONS = ["3.11", "3.13", "3.14"]  # Blender 4.5 LTS, 5.x, and Debian's 5.2
PLATFORMS = {  # Blender's name: the tags of wheels that run there
    "linux-x64": ["manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux_2_17_x86_64", "manylinux2014_x86_64"],
    "windows-x64": ["win_amd64"],
    "macos-arm64": ["macosx_13_0_arm64"],
    "macos-x64": ["macosx_13_0_x86_64"],
}


def pinned(python):
    """["embreex==...", ...]: what WANTED needs on this Python, closed over dependencies, less what Blender has."""
    version = {"python_version": python, "python_full_version": f"{python}.0"}
    locked = {}
    for package in tomllib.loads((ROOT / "uv.lock").read_text())["package"]:
        markers = package.get("resolution-markers")
        if not markers or any(Marker(marker).evaluate(version) for marker in markers):
            locked[package["name"]] = package
    needed, open_ = set(), list(WANTED)
    while open_:
        name = open_.pop()
        if name not in needed | IN_BLENDER:
            needed.add(name)
            open_ += [dependency["name"] for dependency in locked[name].get("dependencies", [])]
    return [f"{name}=={locked[name]['version']}" for name in sorted(needed)]


def download(folder, tags):
    """Fetch the wheels of every Python; returns the Pythons for which all of them exist."""
    complete = []
    for python in PYTHONS:
        fetched = folder / python
        platform = [word for tag in tags for word in ("--platform", tag)]
        command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--only-binary=:all:", "--python-version", python, *platform]
        if subprocess.run([*command, "-d", fetched, *pinned(python)]).returncode:
            continue
        complete.append(python)
        for wheel in fetched.iterdir():
            shutil.move(wheel, folder / wheel.name)  # a wheel for any Python comes three times
    return complete


def build(source, target):
    """Blender's own builder, which ships with bpy and runs without it."""
    (bpy,) = find_spec("bpy").submodule_search_locations
    (script,) = Path(bpy).glob("*/scripts/addons_core/bl_pkg/cli/blender_ext.py")
    subprocess.run([sys.executable, script, "build", "--source-dir", source, "--output-filepath", target],
                   check=True, stdout=subprocess.DEVNULL)
    print(f"{target.relative_to(ROOT)}  {target.stat().st_size / 1e6:.1f} MB", flush=True)


def main():
    version = tomllib.loads((ROOT / "blender_manifest.toml").read_text())["version"]
    DIST.mkdir(exist_ok=True)
    plain = DIST / f"rayscope-{version}.zip"
    build(ROOT, plain)
    left_out, failed = [], False
    for platform, tags in PLATFORMS.items():
        with tempfile.TemporaryDirectory() as folder:
            tree, wheels = Path(folder, "rayscope"), Path(folder, "rayscope", "wheels")
            zipfile.ZipFile(plain).extractall(tree)
            pythons = download(wheels, tags)
            left_out += [f"{platform}: no wheels for Python {python}" for python in PYTHONS if python not in pythons]
            if not pythons:
                failed = True
                continue
            names = [f"./wheels/{wheel.name}" for wheel in sorted(wheels.glob("*.whl"))]
            manifest = tree / "blender_manifest.toml"
            own = f"\nplatforms = {[platform]!r}\nwheels = {names!r}\n\n[permissions]"
            manifest.write_text(manifest.read_text().replace("\n[permissions]", own, 1))
            build(tree, DIST / f"rayscope-{version}-{platform.replace('-', '_')}.zip")
    for line in left_out:
        print(f"LEFT OUT: {line.upper()}")
    return failed


if __name__ == "__main__":
    sys.exit(main())
