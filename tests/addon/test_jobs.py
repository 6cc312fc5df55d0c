"""Jobs: one at a time, in a thread, with progress, stopped at once."""
import threading
import time

import bpy
import pytest
from bl_ext.user_default.rayscope.addon import work
from bl_ext.user_default.rayscope.core.errors import RayscopeError, SceneError


@pytest.fixture(autouse=True)
def nothing_runs_afterwards():
    yield
    work.stop()
    assert not [t for t in threading.enumerate() if t.name.startswith("rayscope")]


def slowly(progress, steps=None):
    for i in range(20_000):  # minutes: nobody waits for its end
        progress(i / 20_000)
        if steps is not None:
            steps.append(i)
        time.sleep(0.01)
    return "done"


def wait_for(condition, seconds=120.0):
    end = time.perf_counter() + seconds
    while not condition():
        assert time.perf_counter() < end
        time.sleep(0.001)


def test_result_and_progress():
    job = work.start("Counting", lambda progress: [progress(0.5), threading.current_thread().name][1])
    wait_for(lambda: not job.running)
    assert job.result == "rayscope: Counting" and job.fraction == 1.0 and not job.error and not job.cancelled


def test_a_second_one_is_refused_by_name():
    first = work.start("Tracing", slowly)
    with pytest.raises(RayscopeError, match="Tracing is still running"):
        work.start("Building", slowly)
    assert work.current() is first


def test_stops_when_it_next_tells_its_progress():
    """Steps are counted, not seconds: the machine may be busy."""
    steps = []
    job = work.start("Tracing", lambda progress: slowly(progress, steps))
    wait_for(lambda: job.fraction > 0)
    job.cancel()
    seen = len(steps)
    wait_for(lambda: not job.running)
    assert 0 < len(steps) <= seen + 1  # one may have been on its way
    assert job.cancelled and not job.error and job.result is None
    assert work.current() is None


@pytest.mark.parametrize(("error", "text"), [
    (SceneError("Cube: its mesh is empty."), "Cube: its mesh is empty."),
    (MemoryError(), "Tracing: there was not enough memory"),
    (ZeroDivisionError("division by zero"), "Tracing: internal error"),
])  # fmt: skip
def test_errors_become_one_line(error, text):
    def fail(progress):
        raise error

    job = work.start("Tracing", fail)
    wait_for(lambda: not job.running)
    assert job.error.startswith(text) and "Traceback" not in job.error


def test_another_file_stops_it_and_forgets_what_was_built():
    from bl_ext.user_default.rayscope.addon import session

    bpy.ops.wm.read_homefile(use_factory_startup=True)
    bpy.ops.rayscope.build()
    assert session.built_of(bpy.context.scene) is not None
    uid = bpy.context.scene.session_uid
    job = work.start("Tracing", slowly)
    bpy.ops.wm.read_homefile(use_factory_startup=True, use_empty=True)
    assert not job.running and job.cancelled and work.current() is None
    assert uid not in session._built and not session._figures
