"""What options of the command mean: functions that take the text and give the value, or say what is wrong."""

import argparse
import os
import re
from pathlib import Path

from .catalogue import technique
from .errors import ParameterError, RayscopeError
from .options import AUTOMATIC
from .parameters import resolve
from .scene.camera import check_size

#: Longer side of a picture whose size was not given.
DEFAULT_SIDE = 640


def whole(low, high):
    """A type of option: a whole number from low to high."""
    return _between(int, "a whole number", "d", low, high)


def number(low, high):
    """A type of option: a number from low to high."""
    return _between(float, "a number", "g", low, high)


def _between(kind, needed, form, low, high):
    """What reads a number of some kind from low to high; `form` shows these."""
    def parse(text):
        try:
            value = kind(text)
        except ValueError:
            raise argparse.ArgumentTypeError(f"{needed} is needed, not {text!r}") from None
        if not low <= value <= high:                                      # nor is NaN
            raise argparse.ArgumentTypeError(f"{text} does not lie between {low:{form}} and {high:{form}}")
        return value
    return parse


def add_parameters(parser, parameters):
    """Add an option for each declared parameter: its name, range, default and help."""
    for p in parameters:
        option, told = "--" + p.name.replace("_", "-"), p.help[:1].lower() + p.help[1:]
        if p.type is bool:
            parser.add_argument(option, action="store_true", help=told)
            continue
        told += f" (default: {p.default})"
        if p.choices:
            parser.add_argument(option, choices=p.choices, default=p.default, help=told)
        else:
            kind = whole if p.type is int else number
            parser.add_argument(option, metavar="N", type=kind(p.low, p.high), default=p.default, help=told)


#: A type of option: the seed of random numbers.
seed = whole(0, 2**31 - 1)


def picture_size(text):
    """A type of option: WxH in pixels."""
    match = re.fullmatch(r"(-?\d+)[xX](-?\d+)", text)
    if not match:
        raise argparse.ArgumentTypeError(f"width and height are written like 640x480, not {text!r}")
    try:
        return check_size(match.groups())
    except RayscopeError as error:
        raise argparse.ArgumentTypeError(str(error).rstrip(".")) from None


def assignment(text):
    """A type of option: NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not (name and equals):
        raise argparse.ArgumentTypeError(f"a parameter is written NAME=VALUE, not {text!r}")
    return name, value


def specification(text):
    """A type of option: a technique with parameters, ``grid:walk=add:density=2``; (name, parameters)."""
    name, *parameters = text.split(":")
    return name, dict(assignment(p) for p in parameters)


def frame_range(text):
    """A type of option: FIRST:LAST or FIRST:LAST:STEP."""
    match = re.fullmatch(r"(-?\d+):(-?\d+)(?::(\d+))?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"frames are written FIRST:LAST or FIRST:LAST:STEP, not {text!r}")
    return tuple(None if part is None else int(part) for part in match.groups())


def checked(choice, core):
    """A technique's name and its parameters' values in their own types.

    Raises
    ------
    ParameterError
    """
    name, given = choice
    if name == AUTOMATIC and not given:
        return name, {}
    row = technique(name)
    if core not in row.cores:
        raise ParameterError(f"{name} has no core {core!r}. It has: {', '.join(row.cores)}.")
    values = resolve(name, row.parameters, given, core)
    return name, {key: values[key] for key in given}


def check_output(option, path, ending):
    """Fail before the work rather than after it when a file cannot be written, or has another format's ending."""
    if path is None:
        return
    parent = Path(path).absolute().parent
    if Path(path).is_dir():
        raise ParameterError(f"{option} {path}: this is a folder; name a file.")
    if not str(path).lower().endswith(ending):
        raise ParameterError(f"{option} {path}: this file is written as {ending[1:].upper()}; give it a name that ends with {ending}.")
    if not parent.is_dir():
        raise ParameterError(f"{option} {path}: there is no folder {parent}; make it, or choose another.")
    if not os.access(path if Path(path).exists() else parent, os.W_OK):
        raise ParameterError(f"{option} {path}: it may not be written there; choose another place.")


def proportional(camera):
    """Picture size with a camera's own proportions, DEFAULT_SIDE on the longer side."""
    if camera is None:
        return DEFAULT_SIDE, DEFAULT_SIDE * 3 // 4
    left, right, bottom, top = camera.window
    width, height = abs(right - left), abs(top - bottom)
    scale = DEFAULT_SIDE / max(width, height)
    return max(1, round(width * scale)), max(1, round(height * scale))
