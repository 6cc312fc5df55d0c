"""The command without Blender: what it prints, its exit codes, one line for every error."""
import json
import os
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
from rayscope.core import Camera, Light, Mesh, Object, Scene, SceneError, rendering, techniques
from rayscope.core import command
from rayscope.core.command import DONE, FAILED, VERBS, WRONG_CALL, main
from rayscope.core.fast.hierarchies.bvh import BVH
from rayscope.core.lab import against_brute, bench
from rayscope.core.options import PARAMETERS


ROOT = Path(__file__).resolve().parents[2]


def scene(size=None, n=200, **more):
    rng = np.random.default_rng(1)
    corners = rng.uniform(-1, 1, (n, 1, 3)) + rng.normal(0, 0.2, (n, 3, 3))
    more.setdefault("camera", Camera.look_at((0, -5, 1), (0, 0, 0), aspect=size[0] / size[1] if size else 2.0))
    return Scene([Object("soup", Mesh(corners.reshape(-1, 3), np.arange(3 * n).reshape(-1, 3)))],
                 [Light("Lamp", "point", (90, 90, 90), position=(2, -2, 4))], name="soup", **more)


@pytest.fixture
def run(capfd):
    """Runs the command on the open scene; gives exit code, stdout, lines of stderr."""
    def call(*argv, read=scene, **more):
        code = main([str(a) for a in argv], read, **more)
        out, err = capfd.readouterr()
        return code, out, err.splitlines()
    return call


# --- list -------------------------------------------------------------------------------------------------------------

def test_list(run):
    code, out, err = run("list")
    assert code == DONE and not err
    for t in techniques():
        assert re.search(rf"^{t.name}: ", out, re.M)
        for p in t.parameters:
            assert f"    {p.name} = " in out


def test_list_json(run):
    code, out, err = run("list", "--json")
    rows = {t["name"]: t for t in json.loads(out)["techniques"]}
    assert code == DONE and list(rows) == [t.name for t in techniques()]
    builder = next(p for p in rows["bvh"]["parameters"] if p["name"] == "builder")
    assert builder["default"]["pure"] in builder["choices"]["pure"] and builder["default"]["fast"] in builder["choices"]["fast"]


# --- trace ------------------------------------------------------------------------------------------------------------

def test_trace(run, tmp_path):
    image, figures = tmp_path / "a.png", tmp_path / "a.json"
    code, out, err = run("trace", "--size", "40x30", "--image", image, "--figures", figures, "--count", "--set", "builder=sah")
    assert code == DONE, err
    head = image.read_bytes()[:24]
    assert head[:4] == b"\x89PNG" and head[16:] == (40).to_bytes(4, "big") + (30).to_bytes(4, "big")
    record = json.loads(figures.read_text())
    assert record["parameters"]["size"] == [40, 30] and record["parameters"]["parameters"] == {"builder": "sah"}
    assert {"rayscope", "machine", "scene", "seed"} <= record.keys() and record["scene"]["primitives"] == 200
    assert record["figures"]["primary"]["rays"] == 1200 and record["figures"]["primary"]["N_IT"] > 0
    assert str(image) in out and "N_IT" in out and re.search(r"^primary +bvh +1200", out, re.M)


def test_options_of_trace_are_those_that_are_declared(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "1000")                               # no word is divided
    monkeypatch.setenv("NO_COLOR", "1")
    code, out, err = run("trace", "--help")
    text = " ".join(out.split())
    for p in PARAMETERS:
        option = "--" + p.name.replace("_", "-")
        told = p.help[:1].lower() + p.help[1:]
        assert code == DONE and option in text and (told if p.type is bool else f"{told} (default: {p.default})") in text


def test_trace_json_alone_on_stdout(run):
    code, out, err = run("trace", "--size", "8x8", "--json")
    assert code == DONE and json.loads(out)["figures"]["primary"]["rays"] == 64


def test_trace_each_kind_of_ray_its_own_technique(run):
    code, out, err = run("trace", "--size", "16x16", "--technique", "brute", "--shadow", "bvh:builder=sah", "--json")
    figures = json.loads(out)["figures"]
    assert (figures["primary"]["technique"], figures["shadow"]["technique"]) == ("brute", "bvh")


def test_trace_pure(run):
    code, out, err = run("trace", "--size", "8x6", "--core", "pure", "--technique", "brute", "--json")
    assert code == DONE and json.loads(out)["parameters"]["core"] == "pure"


def test_without_a_size_the_cameras_proportions_hold(run):
    sizes = []

    def read(size):
        sizes.append(size)
        return scene(size)

    code, out, err = run("trace", "--json", read=read)
    assert sizes == [None] and json.loads(out)["parameters"]["size"] == [640, 320]
    run("trace", "--size", "12x10", read=read)
    assert sizes[1] == (12, 10)


def test_notices_go_to_stderr(run):
    def read(size):
        found = scene(size)
        found.objects[0].geometry.vertices[0] = np.nan
        return Scene([Object("broken", Mesh(found.objects[0].geometry.vertices, found.objects[0].geometry.triangles))], found.lights, found.camera)

    code, out, err = run("trace", "--size", "8x8", "--json", read=read)
    assert code == DONE and any(line.startswith("broken: ") and "NaN" in line for line in err)
    assert any("NaN" in n for n in json.loads(out)["scene"]["notices"])


def test_ctrl_c_keeps_what_is_done(run, tmp_path, monkeypatch):
    monkeypatch.setattr(rendering, "INTERVAL", 0.0)
    before = signal.getsignal(signal.SIGINT)

    def press():
        """Once the command listens: before, it would be pytest that is stopped."""
        while signal.getsignal(signal.SIGINT) is before:
            time.sleep(0.01)
        time.sleep(0.2)                                                 # into the trace; nothing depends on how far
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=press, daemon=True).start()
    code, out, err = run("trace", "--size", "256x256", "--samples", "100000", "--image", tmp_path / "a.png", "--json")
    assert code == FAILED and "stopped" in err[-1] and json.loads(out)["stopped"] is True
    assert (tmp_path / "a.png").exists() and signal.getsignal(signal.SIGINT) is before


# --- compare ----------------------------------------------------------------------------------------------------------

def test_compare(run, tmp_path):
    code, out, err = run("compare", "--techniques", "brute,bvh:builder=sah", "--core", "both", "--rays", 40, "--out", tmp_path / "o")
    assert code == DONE, err
    assert re.search(r"^bvh:builder=sah +pure ", out, re.M) and re.search(r"^brute +fast ", out, re.M)
    record = json.loads((tmp_path / "o" / "compare.json").read_text())
    assert record["seed"] == 0 and len(record["rows"]) == 4 and (tmp_path / "o" / "table.csv").exists()


def test_compare_fails_where_a_technique_is_wrong(run, monkeypatch):
    monkeypatch.setattr(BVH, "traverse", lambda self, rays, query: None)
    code, out, err = run("compare", "--techniques", "bvh,brute", "--rays", 100, "--json")
    record = json.loads(out)
    # Bounces start where the bvh hits: there are none.
    assert code == FAILED and record["failed"] and record["rows"][0]["differ"] > 0 and record["rows"][1]["differ"] == 0
    assert "other hits than brute force" in err[-1]


# --- bench ------------------------------------------------------------------------------------------------------------

def test_bench(run):
    code, out, err = run("bench", "--subdivisions", 0, "--size", "12x12", "--repeats", 1, "--json")
    assert code == DONE, err
    record = json.loads(out)
    rows = {r["technique"]: r for r in record["rows"]}
    assert {"bvh:builder=ploc", "bvh:builder=sah", "grid", "octree"} <= rows.keys()
    assert record["rays"] == {"primary": 144, "secondary": 144, "shadow": 144} and record["bar"] is None
    assert record["memory"]["trace_peak"] >= record["memory"]["structure"] > 0
    for peer in {"mathutils", "embree"} & rows.keys():
        assert rows["grid"][f"x_{peer}_primary"] == pytest.approx(rows[peer]["us_primary"] / rows["grid"]["us_primary"])
    assert 20_000 < record["scene"]["primitives"] < 22_000
    assert bench.text(record).count("\n") > 8 and record["against_brute"]["primitives"] == 11


def test_every_hierarchy_is_measured_against_brute_force(run):
    result = against_brute.against_brute(2, (24, 24), 1)
    rows = {r["technique"]: r for r in result["rows"]}
    assert {"brute", "bvh:builder=ploc", "bvh:builder=incremental", "r-tree", "sphere-tree", "obb-tree", "kdop-tree", "sorted-list"} <= rows.keys()
    assert rows["brute"]["x_brute"] == 1.0 and result["primitives"] == 92 and result["rays"] == 576
    for row in rows.values():
        assert row["x_brute"] == pytest.approx(rows["brute"]["us_primary"] / row["us_primary"])
    least = min(r["x_brute"] for r in rows.values())
    assert result["met"] == (rows["bvh:builder=ploc"]["x_brute"] >= 20 and least >= 5) and not result["met"]
    assert "NOT MET" in against_brute.text(result)


def test_growth_fits_exponents(monkeypatch):
    result = bench.growth(levels=(0, 1))
    assert [r["N"] for r in result["rows"] if r["technique"] == "bvh"][1] > 3800 and len(result["exponents"]) == 3
    two = [r for r in result["rows"] if r["technique"] == "grid"]
    expected = np.log(two[1]["T_B"] / two[0]["T_B"]) / np.log(two[1]["N"] / two[0]["N"])
    assert next(e for e in result["exponents"] if e["technique"] == "grid")["e_build"] == pytest.approx(expected)


def test_the_bar_of_the_bench():
    def bar(primary, secondary, most, size=1e6):
        row = {"technique": "bvh", "x_mathutils_primary": primary, "x_mathutils_secondary": secondary}
        row |= {f"spread_{kind}": [1.0, most] for kind in ("primary", "secondary")}
        found = bench._bar(row, {"trace_peak": size})
        return found["met"], found["doubtful"]

    assert bar(2.1, 2.5, 3.0) == (True, False)
    assert bar(1.9, 2.5, 3.0) == (False, True)
    assert bar(1.5, 1.9, 1.9) == (False, False)
    assert bar(2.1, 2.5, 3.0, 3e8) == (False, False)


# --- wrong calls ------------------------------------------------------------------------------------------------------

WRONG = [
    (["trcae"], "trcae"),
    ([], "VERB"),
    (["trace", "extra"], "extra"),
    (["trace", "--technique", "bhv"], "did you mean 'bvh'"),
    (["trace", "--technique", "bvh:depht=3"], "no parameter 'depht'"),
    (["trace", "--set", "builder"], "NAME=VALUE"),
    (["trace", "--set", "leaf_size=many"], "a whole number"),
    (["trace", "--set", "leaf_size=0"], "between 1 and"),
    (["trace", "--technique", "embree", "--core", "pure"], "no core 'pure'"),
    (["trace", "--shadow", "nothing"], "no technique 'nothing'"),
    (["trace", "--core", "gpu"], "gpu"),
    (["trace", "--size", "0x0"], "0 x 0"),
    (["trace", "--size", "100000x100000"], "100000 x 100000"),
    (["trace", "--size=-4x4"], "-4 x 4"),
    (["trace", "--size", "640"], "640x480"),
    (["trace", "--size", "-4x4"], "argument --size"),  # some Pythons take it for a value
    (["trace", "--size", "9x9", "--samples", "0"], "argument --samples: 0 does not lie between 1 and"),
    (["trace", "--size", "9x9", "--depth", "-1"], "argument --depth: -1 does not lie between 0 and"),
    (["trace", "--aa-threshold", "2"], "argument --aa-threshold: 2 does not lie between 0 and 1"),
    (["trace", "--threshold", "nan"], "argument --threshold: nan"),
    (["trace", "--threshold", "low"], "a number is needed, not 'low'"),
    (["trace", "--sampel", "3"], "--sampel means nothing here. See: rayscope trace --help"),
    (["trace", "--image", "a.jpg"], "written as PNG"),
    (["trace", "--figures", "a.txt"], "ends with .json"),
    (["trace", "--size", "9x9", "--samples", "few"], "few"),
    (["trace", "--image", "/no/such/folder/a.png"], "/no/such/folder"),
    (["trace", "--image", "/"], "folder"),
    (["trace", "--size", "9x9", "--image", "/dev/full/a.png"], "/dev/full"),
    (["trace", "--size", "9x9", "--figures", "/proc/a.json"], "/proc/a.json"),
    (["compare", "--techniques", "bvh,kd-treee", "--rays", "9"], "kd-treee"),
    (["compare", "--techniques", "", "--rays", "9"], "no technique ''"),
    (["compare", "--rays", "0"], "0 does not lie"),
    (["compare", "--rays", "9", "--out", "/proc/out"], "--out /proc/out: the folder cannot be made"),
    (["compare", "--rays", "9", "--out", __file__], "this is a file; name a folder"),
    (["stability", "--cases", "friendlier"], "rayscope stability: There is no case friendlier"),
    (["bench", "--out", "plots"], "--directional"),
    (["bench", "--only", "balls"], "--automatic"),
    (["compare", "--seed", "-1"], "-1"),
]


@pytest.mark.parametrize("argv, names", WRONG, ids=lambda v: " ".join(v) if isinstance(v, list) else "")
def test_a_wrong_call_is_one_line_that_names_it(run, argv, names):
    code, out, err = run(*argv)
    assert code == WRONG_CALL and not out
    assert names in err[-1] and err[-1].startswith("rayscope")
    assert len([line for line in err if line.startswith(("rayscope", "Traceback", "  "))]) == 1


def test_a_scene_without_what_is_needed(run):
    code, out, err = run("trace", "--size", "9x9", read=lambda size: Scene(name="bare"))
    assert code == WRONG_CALL and "bare: there is no camera" in err[-1]
    code, out, err = run("compare", read=lambda size: Scene(name="bare"))
    assert code == WRONG_CALL and "bare: there is nothing to trace" in err[-1]
    # No object at all is a picture of the surroundings.
    assert run("trace", "--size", "9x9", read=lambda size: Scene(camera=scene().camera))[0] == DONE


def test_a_mistake_of_ours_is_one_line_too(run):
    code, out, err = run("trace", "--size", "9x9", read=lambda size: 1 / 0)
    assert code == FAILED and len(err) == 1 and "internal error" in err[0] and "ZeroDivisionError" in err[0] and "test_command.py" in err[0]


@pytest.mark.parametrize("error", [MemoryError(), KeyboardInterrupt()])
def test_out_of_memory_and_stopped(run, error):
    def read(size):
        raise error
    code, out, err = run("trace", read=read)
    assert code == FAILED and len(err) == 1


# --- files ------------------------------------------------------------------------------------------------------------

@pytest.fixture
def run_file(capfd):
    def call(*argv, **more):
        code = main([str(a) for a in argv], **more)
        out, err = capfd.readouterr()
        return code, out, err.splitlines()
    return call


def test_files(run_file, tmp_path):
    for name, said in (("none.blend", "no such file"), ("a.jpg", "Known endings: .nff, .nff.gz, .blend, .obj"), ("folder.obj", "this is a folder")):
        if name.startswith("folder"):
            (tmp_path / name).mkdir()
        code, out, err = run_file("trace", tmp_path / name)
        assert code == WRONG_CALL and name in err[0] and said in err[0] and len(err) == 1
    code, out, err = run_file("compare")
    assert code == WRONG_CALL and "FILE" in err[0]


def test_what_only_blender_reads(run_file, tmp_path):
    path = tmp_path / "a.ply"
    path.write_text("ply")
    code, out, err = run_file("trace", path)
    assert code == FAILED and "pip install bpy" in err[0]
    code, out, err = run_file("trace", path, "--size", "9x9", open_in_blender=lambda p, size: scene(size, camera=None))
    assert code == DONE and any("no camera" in line for line in err)

    def refuse(path, size):
        raise SceneError(f"{path}: not a mesh")
    code, out, err = run_file("trace", path, open_in_blender=refuse)
    assert code == WRONG_CALL and "not a mesh" in err[0]


@pytest.mark.parametrize("size", [(300, 200), (200, 300), None])
def test_the_view_that_is_added_sees_everything(size):
    from rayscope.core.scene.files import add_view
    found = scene(camera=None)
    found.lights.clear()
    add_view(found, size)
    lo, hi = found.bounds()
    corners = np.array([[(lo, hi)[i >> a & 1][a] for a in range(3)] for i in range(8)])
    position, right, up, forward = found.camera.frame()
    seen = corners - position
    depth = seen @ forward
    left, right_, bottom, top = found.camera.window
    x, y = (seen @ right) / depth, (seen @ up) / depth
    assert (depth > 0).all() and left < x.min() and x.max() < right_ and bottom < y.min() and y.max() < top
    assert max((x.max() - x.min()) / (right_ - left), (y.max() - y.min()) / (top - bottom)) > 0.4, "and not from too far away"
    assert [n.text.split(";")[0] for n in found.notices] == ["the file has no camera", "the file has no light"]


# --- as a process -----------------------------------------------------------------------------------------------------

@pytest.fixture
def process(tmp_path):
    """Starts Python where rayscope can be imported, installed or not."""
    (tmp_path / "site").mkdir()
    (tmp_path / "site" / "rayscope").symlink_to(ROOT, target_is_directory=True)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path / "site"), *sys.path])}

    def start(*argv):
        return subprocess.Popen([sys.executable, *argv], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                env=environment, cwd=tmp_path)
    return start


def test_as_a_process(process, tmp_path):
    def finished(*argv):
        with process("-m", "rayscope", *argv) as run:
            return *run.communicate(timeout=600), run.returncode

    out, err, code = finished("list", "--json")
    assert code == DONE and not err and json.loads(out)["verb"] == "list"
    out, err, code = finished("trace", str(tmp_path / "none.blend"))
    assert code == WRONG_CALL and not out and len(err.splitlines()) == 1
    assert finished("--version")[0].startswith("Rayscope ") and finished("trace", "--help")[2] == DONE


def test_a_reader_that_leaves_early_is_no_error(process):
    with process("-m", "rayscope", "list") as run:
        run.stdout.close()
        assert run.stderr.read() == "" and run.wait(600) == FAILED


def test_every_verb_has_help_and_json():
    parser = command.parser(with_file=True)
    for name, verb in VERBS.items():
        call = parser.parse_args([name, *(["x.blend"] if verb.scene else ["x.py"] if name == "check" else []), "--json"])
        assert call.json and verb.help


def test_a_file_for_each_verb_that_only_its_call_imports(process):
    assert {path.stem for path in (ROOT / "core" / "verbs").glob("*.py")} == set(VERBS)
    code = ("import sys; from rayscope.core.command import main; main(['list']); "
            "print(*(name for name in sys.modules if '.verbs.' in name or '.lab.' in name or '.fast' in name), file=sys.stderr)")
    with process("-c", code) as run:
        assert sorted(run.communicate(timeout=600)[1].split()) == ["rayscope.core.lab.report", "rayscope.core.verbs.list"]
