"""The command: ``python -m rayscope VERB FILE ...`` and ``blender -b FILE --command rayscope VERB ...``.

Results go to stdout, progress and log lines to stderr. Exit codes: 0 done, 1 the work failed (a difference was found,
a package is missing, it was stopped), 2 the call was wrong. An error is one line, never a traceback.

A verb is a row of ``VERBS`` and a file of its name in ``verbs``, which is imported when the verb is called. It holds
``options(parser)``, which adds the verb's own, and ``run(call)``, which takes the parsed call and returns an
:class:`~rayscope.core.outcome.Outcome`. ``call.scene(size)`` reads the scene.
"""

import argparse
import os
import sys
import traceback
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

from .errors import Cancelled, MemoryEstimateError, MissingPackageError, ParameterError, RayscopeError
from .lab import report
from .outcome import DONE, FAILED, WRONG_CALL, say
from .scene.files import ENDINGS, read_file


@dataclass(frozen=True)
class Verb:
    """One verb.

    Parameters
    ----------
    name : str
        Its file's name, too.
    help : str
    scene : bool
        Whether it works on a scene.
    """

    name: str
    help: str
    scene: bool = True

    def options(self, parser):
        """Add its own options, and --json."""
        self._module().options(parser)
        parser.add_argument("--json", action="store_true", help="print the result as JSON")

    def run(self, call):
        """Do it; returns an Outcome."""
        return self._module().run(call)

    def _module(self):
        return import_module(f".verbs.{self.name}", __package__)


VERBS = {verb.name: verb for verb in [
    Verb("list", "list all techniques with their parameters", scene=False),
    Verb("trace", "trace a picture"),
    Verb("compare", "run techniques on the same rays; table, CSV, JSON, plots"),
    Verb("bounds", "what bounding volumes are worth, object by object"),
    Verb("motion", "refit trees after motion, against new ones; what the order of insertion does"),
    Verb("error", "error against run time, for each setting that the scene has something for"),
    Verb("bench", "measure against mathutils' BVHTree and Embree", scene=False),
    Verb("kernels", "compare tests of a ray against a triangle or a box: time, operations, bytes, wrong answers",
         scene=False),
    Verb("stability", "run techniques on stiff and extreme cases against exact arithmetic", scene=False),
    Verb("frames", "build one ray classification for all frames of an animation, and hold it against a build for each"),
    Verb("check", "hold a structure of your own against brute force", scene=False),
    Verb("needs", "say what the scene needs, what is left out and why"),
    Verb("inspect", "say what each object costs, and what could be done"),
]}


def main(argv=None, read_scene=None, open_in_blender=None, read_frames=None):
    """Run the command.

    Parameters
    ----------
    argv : list of str, optional
        The verb and what follows it; the process's own arguments if absent.
    read_scene : callable, optional
        Inside Blender: ``read_scene(size)`` reads the scene that is open, for a picture of that (width, height) or of
        the scene's own proportions (None). The verbs then take no FILE.
    open_in_blender : callable, optional
        ``open_in_blender(path, size)`` reads a file that only Blender can read.
    read_frames : callable, optional
        ``read_frames(first, last, step, size, progress)`` reads the animation that is open in Blender: numbers and
        scenes.

    Returns
    -------
    int
        The exit code.
    """
    try:
        call, left = parser(with_file=read_scene is None).parse_known_args(sys.argv[1:] if argv is None else list(argv))
        if left:
            raise ParameterError(f"{left[0]} means nothing here. See: rayscope {call.verb} --help")
    except SystemExit as stop:                                            # --help has printed
        return stop.code or DONE
    except ParameterError as error:
        return _fail(f"rayscope: {error}", WRONG_CALL)
    call.scene = lambda size=None: _scene(call, read_scene, open_in_blender, size)
    call.in_blender = read_scene is not None
    call.open_in_blender = open_in_blender or _no_blender
    call.read_frames = read_frames
    try:
        outcome = VERBS[call.verb].run(call)
        print(report.to_json(outcome.json) if call.json else outcome.text, flush=True)
        return outcome.code
    except BrokenPipeError:                                               # the reader (head, less) has left
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    except (MissingPackageError, MemoryEstimateError, Cancelled) as error:
        return _fail(f"rayscope {call.verb}: {error}", FAILED)
    except RayscopeError as error:
        return _fail(f"rayscope {call.verb}: {error}", WRONG_CALL)
    except OSError as error:
        return _fail(f"rayscope {call.verb}: {error.filename or 'output'}: {error.strerror or error}.", WRONG_CALL)
    except MemoryError:
        return _fail(f"rayscope {call.verb}: there was not enough memory. "
                     "Use fewer primitives, a coarser structure or a smaller picture.", FAILED)
    except KeyboardInterrupt:
        return _fail(f"rayscope {call.verb}: stopped.", FAILED)
    except Exception as error:                                            # a mistake of ours
        where = traceback.extract_tb(error.__traceback__)[-1]
        return _fail(f"rayscope {call.verb}: internal error, please report it: {type(error).__name__}: {error} "
                     f"({Path(where.filename).name}, line {where.lineno}).", FAILED)


def _no_blender(path, size=None):
    """What is called where nothing can read Blender's files."""
    raise MissingPackageError(f"{path}: only Blender can read it.")


def _fail(message, code):
    say(" ".join(message.split()))
    return code


def _scene(call, read_scene, open_in_blender, size):
    """The scene of a call; what was left out of it is said on stderr."""
    scene = read_scene(size) if read_scene else read_file(call.file, open_in_blender, size)
    for notice in scene.notices:
        say(f"{notice}")
    return scene


class Parser(argparse.ArgumentParser):
    """A parser that raises where argparse would print several lines and exit, and gets its options when it is used."""

    options = None

    def parse_known_args(self, args=None, namespace=None):
        if self.options:
            self.options(self)
            self.options = None
        return super().parse_known_args(args, namespace)

    def error(self, message):
        if message.endswith("expected one argument"):
            message += "; one that begins with - is written --option=-1"
        raise ParameterError(f"{message}. See: {self.prog} --help")


def parser(with_file):
    """The command's parser; `with_file`: verbs that need a scene take a FILE."""
    top = Parser(prog="rayscope", allow_abbrev=False,
                 description="Build, trace and compare ray tracing acceleration structures.")
    top.add_argument("--version", action="version", version=f"Rayscope {report.version()}")
    verbs = top.add_subparsers(dest="verb", metavar="VERB", required=True)
    for verb in VERBS.values():
        sub = verbs.add_parser(verb.name, help=verb.help, description=verb.help, allow_abbrev=False)
        if verb.scene and with_file:
            sub.add_argument("file", metavar="FILE", help="scene: " + ", ".join(ENDINGS))
        sub.options = verb.options
    return top
