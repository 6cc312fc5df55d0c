"""What a picture needs: the survey, the model, the choice, and that nothing else is imported or built."""
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from rayscope.core import Camera, Light, Material, Mesh, Object, Scene, Shapes, solids, trace
from rayscope.core import catalogue
from rayscope.core.command import main
from rayscope.core.lab import needs


def scene_of(materials=(Material(),), lights=(), objects=(), copies=1):
    mesh = needs._even(40).objects[0].geometry
    camera = Camera.look_at((3.0, -3.0, 2.0), (0.0, 0.0, 0.0))
    placed = [Object(f"mesh {k}", mesh, np.array([[1, 0, 0, 3.0 * k], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1.0]]), materials) for k in range(copies)]
    return Scene([*placed, *objects], list(lights), camera)



def test_survey():
    glass, mirror = Material("glass", transmission=1.0), Material("mirror", mirror=0.5)
    seen = needs.survey(scene_of((glass, mirror), objects=[Object("ball", Shapes([solids.sphere((0, 0, 3), 1.0)]))], copies=3))
    assert seen.kinds == {"triangle": 120, "sphere": 1} and seen.n == 121
    assert seen.glass == ["glass"] and seen.mirrors == ["mirror"] and not seen.transparent and not seen.lights
    assert seen.size > 6.0 and 7.0 < seen.coordinate < 9.0
    even, uneven = needs.survey(needs._even(2000)), needs.survey(needs._uneven(2000))
    assert even.clutter < 5.0 < 50.0 < uneven.clutter
    assert needs.survey(Scene()).n == 0
    broken = Scene.from_triangles([(0, 0, 0), (1, 0, 0), (0, np.nan, 0), (0, 1, 0)], [(0, 1, 2), (0, 1, 3)])
    assert needs.survey(broken).clutter >= 1.0


def test_looking_is_cheap():
    from time import thread_time
    from rayscope.core import build
    scene = needs._even(60_000)
    look = build_it = np.inf
    for _ in range(2):
        start = thread_time()
        needs.survey(scene)
        look = min(look, thread_time() - start)
    start = thread_time()
    build(scene, "bvh")
    build_it = thread_time() - start
    assert look < 0.05 * build_it


@pytest.mark.parametrize("core", ["fast", "pure"])
def test_calibration(core):
    models, _ = needs.calibration(core)
    assert {"bvh", "brute"} <= set(models) and needs.calibration(core)[0] is models
    n_it, _, seconds = models["brute"].per_ray("primary", 5000, 1.0)
    assert 2500 < n_it < 10_000 and seconds > 0.0
    small, large = models["bvh"].per_ray("primary", 1000, 1.0), models["bvh"].per_ray("primary", 100_000, 1.0)
    assert small[1] < large[1] < 10 * small[1]                          # a tree
    assert models["bvh"].per_ray("primary", 5000, 1.0)[2] < seconds
    assert all(m.build_seconds(10_000) > m.build_seconds(100) for m in models.values())


def test_choice():
    seen = needs.survey(needs._even(20_000))
    choice, rows = needs.choose(seen, {"primary": 100_000, "shadow": 100_000})
    assert set(choice) == {"primary", "shadow"} and "brute" not in choice.values()
    assert [r["s"] for r in rows] == sorted(r["s"] for r in rows)
    models, _ = needs.calibration()
    costs = {name: m.build_seconds(seen.n) + sum(m.per_ray(k, seen.n, seen.clutter)[2] for k in choice) * 100_000 + 4 * m.wave for name, m in models.items()
             if catalogue.technique(name).rays == needs.KINDS}
    whole = [row for row in rows if row["technique"] in costs]
    assert whole[0]["technique"] == min(costs, key=costs.get) and whole[0]["s"] == pytest.approx(min(costs.values()))


def test_techniques_for_some_kinds_of_ray_are_chosen_for_these(monkeypatch):
    def model(build, ray, kind="primary", **more):
        return needs.Model((np.log(build), 0.0), {(kind, c): (0.0, 0.0, 0.0, False) for c in ("n_it", "n_ts")}, (ray, 0.0, 0.0), **more)
    lit = scene_of(lights=[Light(f"light {k}", "point", (1.0, 1.0, 1.0), (k, 0.0, 5.0)) for k in range(3)])
    seen = needs.survey(lit)
    models = {"bvh": model(1.0, 1e-3), "light-buffer": model(1e-9, 1e-5, "shadow", lazy=(np.log(2.0), 0.0), lights=True),
              "image-directory": model(0.1, 1e-6)}
    monkeypatch.setitem(needs._known, "fast", (models, 0.0))
    few, many = {"primary": 10, "shadow": 1000}, {"primary": 100_000, "shadow": 100_000}
    assert needs.choose(seen, few)[0] == {"primary": "bvh", "shadow": "bvh"}            # three lights' buffers are dearer
    choice, rows = needs.choose(seen, many)
    assert choice == {"primary": "image-directory", "shadow": "light-buffer"}
    row = next(r for r in rows if r["technique"] == "light-buffer")
    assert row["T_B"] == pytest.approx(6.0) and row["s"] == pytest.approx(6.0 + 1.0 + 100.0 + 1.0) and "s primary" not in row
    plan = needs.plan(lit, (400, 250))
    assert plan.choice["shadow"] == "light-buffer" and "light-buffer" in needs.text(plan)
    free, fixed = (trace(lit, name, size=(16, 12)) for name in ("automatic", "bvh"))
    assert np.array_equal(free.image, fixed.image)
    forced = trace(lit, size=(16, 12), primary="image-directory", shadow="light-buffer")
    assert np.array_equal(forced.image, fixed.image)


def test_few_rays_cost_a_wave(monkeypatch):
    def model(wave, ray):
        return needs.Model((-20.0, 0.0), {("primary", c): (0.0, 0.0, 0.0, False) for c in ("n_it", "n_ts")}, (ray, 0.0, 0.0), wave=wave)
    monkeypatch.setitem(needs._known, "fast", ({"bvh": model(0.01, 1e-6), "grid": model(0.001, 3e-6)}, 0.0))
    seen = needs.survey(needs._even(100))
    assert [needs.choose(seen, {"primary": n})[0]["primary"] for n in (1000, 100_000)] == ["grid", "bvh"]


def test_choice_follows_the_model(monkeypatch):
    def model(build, ray):
        return needs.Model((np.log(build), 0.0), {("primary", c): (0.0, 0.0, 0.0, False) for c in ("n_it", "n_ts")}, (ray, 0.0, 0.0))
    seen = needs.survey(needs._even(100))
    monkeypatch.setitem(needs._known, "fast", ({"bvh": model(1.0, 1e-3), "grid": model(0.1, 2e-3), "kd-tree": model(50.0, 1e-5)}, 0.0))
    assert needs.choose(seen, {"primary": 10})[0] == {"primary": "grid"}                # the build counts
    assert needs.choose(seen, {"primary": 10**6})[0] == {"primary": "kd-tree"}          # the rays count
    assert needs.choose(seen, {"primary": 10**6, "shadow": 10})[0] == {"primary": "kd-tree", "shadow": "kd-tree"}   # it is built anyway
    dear = needs.Model(*(getattr(model(1.0, 1e-3), f) for f in ("build", "counts", "ns")), shading=1.0)
    monkeypatch.setitem(needs._known, "fast", ({"bvh": dear, "grid": model(0.1, 1e-5)}, 0.0))
    assert needs.choose(seen, {"primary": 10**6})[0] == {"primary": "bvh"}              # a gain lost in what shading takes
    monkeypatch.setitem(needs._known, "fast", ({"bvh": model(1.0, 1e-3), "grid": model(1.0, 0.9e-3)}, 0.0))
    assert needs.choose(seen, {"primary": 10**6})[0] == {"primary": "bvh"}              # a gain smaller than the model's error


@pytest.mark.parametrize("core", ["fast", "pure"])
def test_automatic_draws_the_same_picture(core):
    scene = scene_of((Material("mirror", mirror=0.5),))
    fixed, free = (trace(scene, name, core, (12, 8)) for name in ("bvh", "automatic"))
    assert np.array_equal(fixed.image, free.image)
    assert set(free.structures) == {"primary", "secondary"}
    chosen = trace(scene, "grid", core, (4, 4), secondary="automatic")
    assert chosen.structures["primary"].technique.name == "grid"
    assert chosen.structures["secondary"].technique.name in needs.calibration(core)[0]


def test_plan_says_what_is_left_out():
    plan = needs.plan(scene_of())
    left = {item["what"]: item for item in plan.left_out}
    assert {"secondary rays", "refraction", "shadow rays", "textures", "analytic primitives and Booleans", "a second level of structures"} <= set(left)
    assert set(plan.choice) == {"primary"} and all(item["why"] for item in plan.left_out)
    assert all(any(c.isdigit() and c != "0" for c in item["cost"]) for item in plan.left_out)
    named = {name for item in plan.left_out for name in item["what"].split(", ")} | set(plan.choice.values())
    assert {t.name for t in catalogue.techniques() if t.family != "peers"} <= named
    other = needs.plan(scene_of((Material("glass", transmission=1.0),), objects=[Object("ball", Shapes([solids.sphere((0, 0, 3), 1.0)]))]))
    assert not {"secondary rays", "refraction", "analytic primitives and Booleans"} & {item["what"] for item in other.left_out}
    assert set(other.choice) == {"primary", "secondary"}
    far = Scene.from_triangles(np.random.default_rng(0).random((9, 3)) + 1e6, np.arange(9).reshape(3, 3))
    assert "Move it nearer" in needs.plan(far).precision and "Move" not in plan.precision
    assert "Left out:" in needs.text(plan)


def test_the_verb(tmp_path, capsys):
    path = tmp_path / "scene.nff"
    path.write_text("v\nfrom 0 0 5\nat 0 0 0\nup 0 1 0\nangle 40\nhither 1\nresolution 16 16\nf 1 0 0 1 0 0 0 1\ns 0 0 0 1\n")
    assert main(["needs", str(path), "--size", "16x16", "--json"]) == 0
    record = json.loads(capsys.readouterr().out)
    assert record["plan"]["seen"]["kinds"] == {"sphere": 1} and record["plan"]["choice"]
    assert main(["needs", str(path), "--size", "16x16"]) == 0
    assert "primary rays:" in capsys.readouterr().out
    assert main(["trace", str(path), "--size", "8x8", "--technique", "automatic"]) == 0


# --- what is not needed is not imported -------------------------------------------------------------------------------

SCENE = """
import sys, time
import numpy as np
from rayscope.core import Camera, Light, Material, Mesh, Object, Scene, Shapes, solids, trace
mesh = Mesh(np.random.default_rng(0).random((30, 3)), np.arange(30).reshape(-1, 3))
camera = Camera.look_at((3.0, -3.0, 2.0), (0.0, 0.0, 0.0))
"""


@pytest.fixture
def said(tmp_path):
    """Run a script in a Python of its own, where `rayscope` is this checkout; returns what it printed."""
    (tmp_path / "rayscope").symlink_to(Path(__file__).resolve().parents[2], target_is_directory=True)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(tmp_path), *sys.path])}

    def run(code):
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment)
        assert not done.returncode, done.stderr
        return done.stdout
    return run


@pytest.fixture
def loaded(said):
    """Modules of the core that a script leaves loaded."""
    def run(code):
        names = said(SCENE + code + "\nprint(*sorted(m for m in sys.modules if m.startswith('rayscope.core.')))").split()
        return {name.removeprefix("rayscope.core.") for name in names}
    return run


@pytest.mark.parametrize("core", ["fast", "pure"])
def test_a_plain_scene_loads_nothing_else(core, loaded):
    modules = loaded(f"r = trace(Scene([Object('mesh', mesh)], camera=camera), core='{core}', size=(4, 4))\n"
                     "assert set(r.structures) == {'primary'} and not r.structures['primary'].primitives is None")
    assert f"{core}.hierarchies.bvh" in modules and f"{core}.primitives.triangle" in modules
    unneeded = {f"{core}.primitives.{name}" for name in ("solids", "sphere", "box", "cylinder", "cone", "polygon", "polytope", "pyramid", "instance")}
    unneeded |= {f"{core}.tracing.{name}" for name in ("secondary", "optics", "lights", "shadows", "texture")}
    unneeded |= {f"{core}.{family}" for family in ("subdivision", "directional", "generalised")} | {"peers", "lab.needs", "lab.stability"}
    assert not unneeded & modules
    other = "fast" if core == "pure" else "pure"
    assert not {m for m in modules if m.startswith(other)}


@pytest.mark.parametrize("core", ["fast", "pure"])
@pytest.mark.parametrize("code, module", [
    ("Scene([Object('mesh', mesh, materials=(Material(mirror=0.5),))], camera=camera)", "tracing.secondary"),
    ("Scene([Object('ball', Shapes([solids.sphere((0, 0, 0), 1.0)]))], camera=camera)", "primitives.sphere"),
], ids=["mirror", "sphere"])
def test_what_is_needed_is_loaded(core, code, module, loaded):
    """The other half: the modules whose absence is tested above are those that do the work."""
    assert f"{core}.{module}" in loaded(f"trace({code}, core='{core}', size=(16, 16))")


def test_import_is_quick(said):
    code = "import numpy, time; t = time.process_time(); import rayscope.core; print(time.process_time() - t)"
    times = [float(said(code)) for _ in range(3)]
    assert min(times) < 0.1


def test_looking_imports_nothing(said):
    code = SCENE + ("from rayscope.core.lab import needs\nscene = Scene([Object('mesh', mesh), Object('ball', Shapes([solids.sphere((0, 0, 0), 1.0)] * 3))])\n"
                    "import rayscope.core.scene.solids\nbefore = set(sys.modules)\nneeds.survey(scene)\nprint(*set(sys.modules) - before)")
    assert not said(code).split()


def test_survey_of_solids():
    rng = np.random.default_rng(0)
    corners = rng.random((500, 1, 3)) + 0.01 * rng.normal(size=(500, 3, 3))
    polygons = [solids.polygon(c) for c in corners]
    seen = needs.survey(Scene(solids=polygons))
    assert seen.kinds == {polygons[0].kind: 500} and seen.clutter < 5.0 and 1.0 < seen.size < 2.0
    cut = solids.difference(solids.box((0, 0, 0), (1, 1, 1)), solids.sphere((5, 5, 5), 1.0))
    assert needs.survey(Scene(solids=[cut] * 3)).kinds == {"csg": 3}
