"""Operators: they read the scene, start a job, and look after it until it is done. What a job does is in tasks.py.

From a script, and always in background mode, an operator does its work before it returns. Invoked from the interface
it starts a thread, and a timer keeps the interface up to date; Esc stops it.
"""

import bpy

from . import redraw
from .. import session, work

#: Seconds between two looks at a job that runs.
TICK = 0.05
#: Seconds between two updates of the picture and the panels.
REFRESH = 0.1
#: A run estimated to take longer is asked about before.
ASK_SECONDS = 10.0


class Work:
    """Base of operators with long work.

    A class sets `title` and defines ``prepare(context)`` (on the main thread: read the scene, return a task),
    ``show(task)`` (on the main thread, now and then while the task runs) and ``finish(task, job)`` (at the end,
    also after Esc; returns what to tell the user).
    """

    def invoke(self, context, event):
        try:
            work.check_idle()
            self._task = self.prepare(context)
            self._interactive = True
            if self._task.estimate.seconds <= ASK_SECONDS:
                return self._start(context)
        except Exception as error:
            self.report({"ERROR"}, work.explain(self.title, error))
            return {"CANCELLED"}
        return context.window_manager.invoke_props_dialog(self, width=420, title=self.bl_label, confirm_text="Go Ahead")

    def draw(self, context):
        column = self.layout.column()
        for line in self._task.estimate.lines():
            column.label(text=line)

    def execute(self, context):
        try:
            if getattr(self, "_interactive", False):  # the dialog's "go ahead"
                return self._start(context)
            work.check_idle()
            task = self.prepare(context)
            if task.estimate.seconds > ASK_SECONDS:
                print("Rayscope:", *task.estimate.lines())
            manager = context.window_manager
            manager.progress_begin(0.0, 1.0)
            try:
                job = work.Job(self.title, lambda progress: task(_both(progress, manager.progress_update))).run()
            finally:
                manager.progress_end()
        except Exception as error:
            self.report({"ERROR"}, work.explain(self.title, error))
            return {"CANCELLED"}
        return self._end(task, job)

    def _start(self, context):
        self._job = work.start(self.title, self._task)
        self._shown, self._last, self._pause = 0.0, 0.0, REFRESH
        manager = context.window_manager
        self._timer = manager.event_timer_add(TICK, window=context.window)
        manager.progress_begin(0.0, 1.0)
        context.workspace.status_text_set(f"{self.title}: Esc stops it")
        manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        job = self._job
        if event.type == "ESC" and event.value == "PRESS":
            job.cancel()
        if job.cancelled or not job.running:
            self._leave(context)
            return self._end(self._task, job)
        if event.type != "TIMER":
            return {"PASS_THROUGH"}
        now = job.seconds
        # Where redraws are slow (a huge picture, no graphics card) they are made rarer, lest they take all the time.
        self._pause = max(REFRESH, 0.9 * self._pause, 4.0 * (now - self._last - TICK))
        self._last = now
        if now - self._shown > self._pause:
            self._shown = now
            context.window_manager.progress_update(job.fraction)
            context.workspace.status_text_set(f"{self.title}: {job.fraction:.0%}, Esc stops it")
            self.show(self._task)
            redraw.panels()
        return {"PASS_THROUGH"}

    def cancel(self, context):
        """Blender ends the operator: another file is opened, or the window closes."""
        self._job.cancel()
        self._leave(context)

    def _leave(self, context):
        manager = context.window_manager
        manager.event_timer_remove(self._timer)
        manager.progress_end()
        if context.workspace:
            context.workspace.status_text_set(None)

    def _end(self, task, job):
        if job.error:
            self.report({"ERROR"}, job.error)
            redraw.panels()
            return {"CANCELLED"}
        self.report({"WARNING" if job.cancelled else "INFO"}, self.finish(task, job))
        redraw.panels()
        return {"CANCELLED"} if job.cancelled else {"FINISHED"}


def _both(first, second):
    def progress(fraction):
        first(fraction)
        second(fraction)
    return progress


class RAYSCOPE_OT_build(Work, bpy.types.Operator):
    bl_idname = "rayscope.build"
    bl_label = "Build Structure"
    bl_description = "Build the technique's structure over the scene as the viewport shows it, for the overlay and the figures"

    title = "Building"

    def prepare(self, context):
        from .. import tasks
        return tasks.Build(context)

    def show(self, task):
        pass

    def finish(self, task, job):
        if job.cancelled:
            return "Building was stopped: the structure shown is the previous one"
        session.keep_built(task.uid, job.result)
        redraw.views()
        return f"Built in {job.result.index.figures['T_B']:.3g} s"


class RAYSCOPE_OT_trace(Work, bpy.types.Operator):
    bl_idname = "rayscope.trace"
    bl_label = "Trace Image"
    bl_description = ("Trace the scene from its camera, with the modifiers as the viewport has them, into the image \"Rayscope\", "
                      "shown in an Image Editor if one is open")

    title = "Tracing"

    def prepare(self, context):
        from .. import tasks
        return tasks.Trace(context.evaluated_depsgraph_get())

    def show(self, task):
        if task.changed:
            task.changed = False
            self._put(task)

    @staticmethod
    def _put(task):
        from ..show import image
        picture = image.put(task.result.image)
        return picture, image.show(picture)

    def finish(self, task, job):
        if task.result is None:
            return "Tracing was stopped while the structure was built: the image is unchanged"
        picture, shown = self._put(task)
        where = "" if shown else f': see the image "{picture.name}" in an Image Editor'
        task.keep()
        if job.cancelled:
            return f"Tracing was stopped at {job.fraction:.0%}, what was done is kept{where}"
        return f"Traced {task.size[0]} x {task.size[1]} pixels in {job.seconds:.3g} s{where}"


class RAYSCOPE_OT_cancel(bpy.types.Operator):
    bl_idname = "rayscope.cancel"
    bl_label = "Stop"
    bl_description = "Stop what is running and keep what was done"

    @classmethod
    def poll(cls, context):
        return work.current() is not None

    def execute(self, context):
        work.current().cancel()
        return {"FINISHED"}


class RAYSCOPE_OT_clear(bpy.types.Operator):
    bl_idname = "rayscope.clear"
    bl_label = "Clear Structure"
    bl_description = "Forget the structure that was built, its overlay and its figures, and free their memory"

    @classmethod
    def poll(cls, context):
        return session.built_of(context.scene) is not None

    def execute(self, context):
        session.forget(context.scene.session_uid)
        redraw.views()
        redraw.panels()
        return {"FINISHED"}


register, unregister = bpy.utils.register_classes_factory((RAYSCOPE_OT_build, RAYSCOPE_OT_trace, RAYSCOPE_OT_cancel, RAYSCOPE_OT_clear))
