"""What a run of the command gives: its outcome on stdout, what it says meanwhile on stderr, and what Ctrl+C leaves."""

import contextlib
import signal
import sys
import time
from dataclasses import dataclass

from .errors import Cancelled

DONE, FAILED, WRONG_CALL = 0, 1, 2

#: Seconds between two lines of progress.
INTERVAL = 5.0


@dataclass
class Outcome:
    """What a verb returns.

    Parameters
    ----------
    text : str
        For people.
    json : dict
        The same for programs, see :func:`rayscope.core.lab.report.record`.
    code : int
        Exit code.
    """

    text: str
    json: dict
    code: int = DONE


def say(line):
    """Print a log line."""
    print(line, file=sys.stderr, flush=True)


@contextlib.contextmanager
def stoppable():
    """A progress callback that prints a line now and then, when there is news.

    Ctrl+C makes it raise Cancelled, so that what is done can be kept.
    """
    stopped, told, said = [], [time.monotonic()], [""]

    def progress(fraction):
        if stopped:
            raise Cancelled("stopped.")
        line = f"{100 * fraction:.0f} %"
        if line != said[0] and time.monotonic() - told[0] > INTERVAL:
            told[0], said[0] = time.monotonic(), line
            say(line)

    before = signal.signal(signal.SIGINT, lambda *_: stopped.append(True))
    try:
        yield progress
    finally:
        # None: a handler that Python did not install, as in Blender; it cannot be put back.
        signal.signal(signal.SIGINT, signal.SIG_DFL if before is None else before)
