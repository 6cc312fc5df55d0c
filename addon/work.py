"""One long piece of core work at a time, in a thread of its own, so that Blender's interface stays alive.

The thread runs core functions on numpy arrays and never touches bpy or gpu: the scene is read before it starts, and
whoever started it looks at `fraction` and `running` from Blender's main thread.
"""

import logging
import threading
import time

from ..core.errors import Cancelled, RayscopeError

#: Seconds to wait for a cancelled thread when the add-on is disabled or another file is opened.
PATIENCE = 10.0


def explain(title, error):
    """What a user reads about an exception, in one line."""
    if isinstance(error, RayscopeError):
        return str(error)
    if isinstance(error, MemoryError):
        return f"{title}: there was not enough memory. Use fewer primitives, a coarser structure or a smaller picture."
    # A mistake of ours: the traceback goes to whoever debugs.
    logging.getLogger(__name__).debug("%s", title, exc_info=error)
    return f"{title}: internal error, please report it ({type(error).__name__}: {error})."


class Job:
    """A function that runs in a thread, tells how far it is, and can be stopped.

    Parameters
    ----------
    title : str
        What is being done, shown beside the progress.
    function : callable
        Called as ``function(progress)``; it calls ``progress(fraction)`` at least every 0.1 s, which raises
        :class:`~rayscope.core.errors.Cancelled` once the job has been cancelled.

    Attributes
    ----------
    fraction : float
        0 to 1.
    result : object
        What the function returned.
    error : str
        What went wrong, for the user; empty if nothing.
    cancelled : bool
    """

    def __init__(self, title, function):
        self.title, self.fraction, self.result, self.error = title, 0.0, None, ""
        self.started = time.perf_counter()
        self._function = function
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self.run, name=f"rayscope: {title}", daemon=True)

    def start(self):
        """Run in a thread of its own; returns at once."""
        self._thread.start()
        return self

    def run(self):
        """Run here, until it is finished."""
        try:
            self.result = self._function(self.progress)
            self.fraction = 1.0
        except Cancelled:
            self._stop.set()
        except Exception as error:
            self.error = explain(self.title, error)
        return self

    def progress(self, fraction):
        """What the function calls; raises Cancelled once it should stop."""
        self.fraction = min(1.0, max(0.0, float(fraction)))
        if self._stop.is_set():
            raise Cancelled(f"{self.title} was cancelled.")

    def cancel(self):
        """Ask it to stop; returns at once."""
        self._stop.set()

    def join(self):
        """Wait until the thread has ended."""
        if self._thread.is_alive():
            self._thread.join(PATIENCE)

    @property
    def running(self):
        return self._thread.is_alive()

    @property
    def cancelled(self):
        return self._stop.is_set()

    @property
    def seconds(self):
        """Since it was made."""
        return time.perf_counter() - self.started


_current = None


def current():
    """The job that runs now, or None."""
    return _current if _current is not None and _current.running else None


def check_idle():
    """Raise a RayscopeError while a job runs."""
    if current() and not _current.cancelled:
        raise RayscopeError(f"{_current.title} is still running: wait for it, or press Esc to stop it.")


def start(title, function):
    """Start a job in its thread.

    Raises
    ------
    RayscopeError
        While another one runs.
    """
    global _current
    check_idle()
    _current = Job(title, function).start()
    return _current


def stop():
    """Cancel what runs and wait until it has stopped; for file load and unregister."""
    global _current
    if _current is not None:
        _current.cancel()
        _current.join()
        _current = None
