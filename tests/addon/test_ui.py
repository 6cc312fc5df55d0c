"""Settings, operators and figures, without a window."""
import bpy
import pytest
from bl_ext.user_default.rayscope.addon import session, work
from bl_ext.user_default.rayscope.addon.ui import operators, panels, primitives, properties
from bl_ext.user_default.rayscope.core import catalogue
from bl_ext.user_default.rayscope.core.figures import FIGURES

ROWS = [(row, core) for row in catalogue.techniques() for core in row.cores]


@pytest.fixture
def scene():
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    return bpy.context.scene


@pytest.mark.parametrize(("row", "core"), ROWS, ids=[f"{row.name}-{core}" for row, core in ROWS])
def test_settings_follow_the_catalogue(scene, row, core):
    settings = scene.rayscope
    settings.technique, settings.core = row.name, core
    assert settings.core_used() == core
    values = settings.values()
    assert values == {p.name: pytest.approx(p.default_in(core)) for p in row.parameters}
    for parameter in row.parameters:
        declared = settings.group().bl_rna.properties[parameter.name]
        assert parameter.help in declared.description and declared.name == parameter.label
        if parameter.choices:
            assert [item.identifier for item in declared.enum_items] == list(parameter.choices_in(core))
        elif parameter.low is not None:
            assert declared.hard_min == pytest.approx(parameter.low) and declared.hard_max == pytest.approx(parameter.high)


def test_a_core_that_a_technique_lacks_is_not_used(scene):
    scene.rayscope.core, scene.rayscope.technique = "pure", "embree"
    assert scene.rayscope.core_used() == "fast"


def test_settings_are_saved_by_name_not_by_place_in_the_menu(scene, tmp_path):
    numbers = [item.value for item in scene.rayscope.bl_rna.properties["technique"].enum_items if item.identifier]
    assert len(set(numbers)) == len(catalogue.techniques()) and min(numbers) > 1000
    scene.rayscope.technique = "octree"
    scene.rayscope.parameters.octree_fast.max_depth = 5
    bpy.ops.wm.save_as_mainfile(filepath=str(tmp_path / "saved.blend"))
    bpy.ops.wm.read_homefile(use_factory_startup=True)
    assert bpy.context.scene.rayscope.technique == "bvh"
    bpy.ops.wm.open_mainfile(filepath=str(tmp_path / "saved.blend"))
    assert bpy.context.scene.rayscope.technique == "octree" and bpy.context.scene.rayscope.values()["max_depth"] == 5


def test_everything_has_a_tooltip_and_a_title():
    for cls in properties.CLASSES:
        for prop in cls.bl_rna.properties:
            if prop.identifier in ("rna_type", "name") or prop.type == "POINTER":
                continue
            assert prop.description and not prop.description.endswith("."), (cls.__name__, prop.identifier)
            if cls is not properties.RAYSCOPE_PG_figures:
                assert prop.name[:1].isupper(), (cls.__name__, prop.identifier)
            for item in getattr(prop, "enum_items", ()):
                assert item.name and (item.description or not item.identifier), (cls.__name__, item.identifier)
    for name in ("build", "trace", "cancel", "clear"):
        description = getattr(operators, f"RAYSCOPE_OT_{name}").bl_description
        assert description and not description.endswith(".")


def test_build_fills_the_figures(scene):
    assert bpy.ops.rayscope.build() == {"FINISHED"}
    figures = scene.rayscope.figures
    built = session.built_of(scene)
    assert figures.N == "12" and figures.T_B.endswith(" s") and figures.memory and figures.N_IT == ""
    assert len(built.cells) > 1 and built.cells.count[0] == 12 and not built.stale
    scene.rayscope.technique = "grid"  # chosen, not built
    assert panels.built_text(built) == f"bvh, {len(built.cells)} cells"
    assert panels._ends(built, "LEVEL", False) == ("LEVEL", 0.0, float(built.cells.level.max()))
    assert set(built.index.figures) <= set(FIGURES), "every figure of a build has a row in the table"


def test_traces_go_into_one_image_and_leave_others_alone(scene, tmp_path):
    scene.render.resolution_x, scene.render.resolution_y = 16, 12

    def traced():
        assert bpy.ops.rayscope.trace() == {"FINISHED"}
        return sorted(image.name for image in bpy.data.images if image.name.startswith("Rayscope"))

    assert traced() == traced() == ["Rayscope"]
    kept = bpy.data.images["Rayscope"]
    kept.filepath_raw, kept.file_format = str(tmp_path / "kept.png"), "PNG"
    kept.save()
    kept.source = "FILE"  # as Image > Save As leaves it
    assert traced() == traced() == ["Rayscope", "Rayscope.001"], "one more image for each picture"
    assert kept.source == "FILE" and bpy.data.images["Rayscope.001"].pixels[3] == 1.0


def test_trace_adds_its_figures(scene):
    scene.render.resolution_x, scene.render.resolution_y = 32, 24
    scene.rayscope.count = True
    bpy.ops.rayscope.build()
    bpy.ops.rayscope.trace()
    figures = scene.rayscope.figures
    assert figures.N == "12" and figures.T_R.endswith(" s")
    rays = session.rays_of(scene)
    assert rays["primary"]["rays"] == 32 * 24 and rays["primary"]["N_IT"] > 0 and "refracted" not in rays


@pytest.mark.parametrize(("name", "value", "text"), [
    ("memory", 512, "512 bytes"), ("memory", 34_500, "34.5 kB"), ("memory", 2_500_000_000, "2.5 GB"), ("N", 1234567, "1,234,567"),
    ("T_B", 0.01234, "0.0123 s"), ("c_SAH", 19.237, "19.2"), ("r_ITM", float("inf"), "inf"), ("T_R", 12345.6, "12,346 s"),
])  # fmt: skip
def test_figures_as_text(name, value, text):
    assert properties.shown(name, value) == text


def test_a_structure_gets_stale_when_an_object_moves_but_not_when_a_setting_changes(scene):
    bpy.ops.rayscope.build()
    scene.rayscope.overlay.leaves_only = True
    scene.rayscope.samples = 3
    bpy.data.objects["Light"].location.x += 1
    bpy.context.view_layer.update()
    assert not session.built_of(scene).stale
    bpy.data.objects["Cube"].location.x += 1
    bpy.context.view_layer.update()
    assert session.built_of(scene).stale and panels.built_text(session.built_of(scene)) == "bvh, out of date"
    bpy.ops.rayscope.build()
    assert not session.built_of(scene).stale
    bpy.data.objects.remove(bpy.data.objects["Cube"])
    bpy.ops.mesh.primitive_cube_add()
    bpy.ops.mesh.primitive_cube_add()
    assert session.built_of(scene).stale


def test_a_panel_that_comes_and_goes_moves_no_other(scene):
    """What is selected decides whether there is a primitive's panel; it stands below those that are always there."""
    always = panels.RAYSCOPE_PT_structure, panels.RAYSCOPE_PT_trace
    assert primitives.RAYSCOPE_PT_primitive.bl_order > max(getattr(panel, "bl_order", 0) for panel in always)


def test_clear(scene):
    assert not bpy.ops.rayscope.clear.poll() and not bpy.ops.rayscope.cancel.poll()
    bpy.ops.rayscope.build()
    assert bpy.ops.rayscope.clear() == {"FINISHED"}
    assert session.built_of(scene) is None and scene.rayscope.figures.N == ""


def test_undo_leaves_what_was_built_usable(scene):
    bpy.ops.ed.undo_push(message="before")
    bpy.ops.rayscope.build()
    bpy.data.objects["Cube"].location.x = 2
    bpy.ops.ed.undo_push(message="moved")
    bpy.ops.ed.undo()
    scene = bpy.context.scene
    assert session.built_of(scene) is not None and scene.rayscope.figures.N == "12"
    scene.render.resolution_x = scene.render.resolution_y = 16
    assert bpy.ops.rayscope.trace() == {"FINISHED"}


@pytest.mark.parametrize(("prepare", "operator", "text"), [
    (lambda: bpy.data.objects.remove(bpy.data.objects["Cube"]), "build", "Scene: it shows no mesh"),
    (lambda: bpy.data.objects.remove(bpy.data.objects["Camera"]), "trace", "no camera"),
    (lambda: setattr(bpy.context.scene, "camera", bpy.data.objects["Cube"]), "trace", "Cube"),
])  # fmt: skip
def test_errors_name_the_thing(scene, capfd, prepare, operator, text):
    prepare()
    with pytest.raises(RuntimeError, match=text):
        getattr(bpy.ops.rayscope, operator)()
    assert "Traceback" not in capfd.readouterr().err


def test_what_was_left_out_is_listed(scene):
    bpy.data.meshes["Cube"].vertices[0].co.x = float("nan")
    bpy.ops.rayscope.build()
    assert [notice.name for notice in session.notices_of(scene)] == ["Cube"]
    assert "NaN" in session.notices_of(scene)[0].text and session.built_of(scene).cells.count[0] < 12


def test_nothing_starts_while_a_job_runs(scene):
    import threading
    go = threading.Event()
    work.start("Tracing", lambda progress: go.wait(600))
    try:
        for operator in (bpy.ops.rayscope.build, bpy.ops.rayscope.trace):
            with pytest.raises(RuntimeError, match="Tracing is still running: wait for it, or press Esc"):
                operator()
        assert bpy.ops.rayscope.cancel.poll()
    finally:
        go.set()
        work.stop()


def test_a_long_run_is_announced(scene, capfd, monkeypatch):
    monkeypatch.setattr(operators, "ASK_SECONDS", 0.0)
    scene.render.resolution_x = scene.render.resolution_y = 16
    bpy.ops.rayscope.trace()
    out = capfd.readouterr().out
    assert "Rayscope: This will take about" in out and "MB of memory" in out


def test_too_little_memory_is_said_before(scene, monkeypatch):
    from bl_ext.user_default.rayscope.core.lab import estimate
    monkeypatch.setattr(estimate, "free_memory", lambda: 1000)
    for operator in (bpy.ops.rayscope.build, bpy.ops.rayscope.trace):
        with pytest.raises(RuntimeError, match="GB of memory would be needed for 12 primitives"):
            operator()
    assert session.built_of(scene) is None


def test_kinds_of_rays_have_techniques_of_their_own(scene, monkeypatch):
    from bl_ext.user_default.rayscope.addon import tasks

    scene.render.resolution_x, scene.render.resolution_y = 12, 10
    settings = scene.rayscope

    def used():
        figures = tasks.Trace(bpy.context.evaluated_depsgraph_get())(lambda fraction: None).figures
        return figures["primary"]["technique"], figures["shadow"]["technique"]

    assert used() == ("bvh", "bvh")
    settings.technique = "image-directory"
    assert used() == ("image-directory", "bvh")
    settings.technique, settings.shadow = "grid", "light-buffer"
    assert used() == ("grid", "light-buffer")
    settings.primary = settings.shadow = "automatic"
    monkeypatch.setattr("bl_ext.user_default.rayscope.core.lab.needs.resolve_automatic", lambda *a: {"primary": ([("octree", 0.0)], 9), "shadow": ([("kd-tree", 0.0)], 9)})
    assert used() == ("octree", "kd-tree")
    items = {kind: {i.identifier for i in settings.bl_rna.properties[kind].enum_items} for kind in ("primary", "secondary", "shadow")}
    assert "image-directory" in items["primary"] and "image-directory" not in items["shadow"]
    assert all("cones" not in names and {"chosen", "automatic", "bvh"} <= names for names in items.values())
