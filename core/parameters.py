"""How a technique declares its parameters.

A declaration is data: the panels, the command's options, the documentation and
the property tests are made from it, and :func:`resolve` checks a call against it.
"""

import difflib
from dataclasses import dataclass

from .errors import ParameterError


@dataclass(frozen=True)
class Parameter:
    """One parameter of a technique.

    Parameters
    ----------
    name : str
        Keyword in ``build`` and in the command.
    default : bool, int, float or str, or dict
        Its type is the parameter's type. A dict ``{"pure": ..., "fast": ...}``
        where the cores' defaults differ.
    help : str
        One line, shown as the tooltip.
    choices : tuple of str, optional
        The values possible, for a parameter of type str.
    low, high : number, optional
        The range, both ends included.
    unit : str
        Unit of the value, ``""`` for a pure number.
    only : dict, optional
        ``{choice: core}`` for choices that one core alone offers.
    depends : tuple, optional
        ``(name, choice)``: it has an effect only where the parameter of that name has that value.
    inexact : tuple of str, optional
        Choices that are there to show what they get wrong: their hits may differ from the default's by rounding, and near edges
        by more. All others promise the same hits.
    """

    name: str
    default: object
    help: str
    choices: tuple = ()
    low: float | None = None
    high: float | None = None
    unit: str = ""
    only: tuple = ()
    depends: tuple = ()
    inexact: tuple = ()

    def default_in(self, core):
        """The default in one core."""
        return self.default[core] if isinstance(self.default, dict) else self.default

    @property
    def type(self):
        """bool, int, float or str."""
        return type(self.default_in("fast"))

    @property
    def label(self):
        """The name as Blender's interface shows it."""
        return self.name.replace("_", " ").title().replace("Aa ", "AA ")

    def choices_in(self, core):
        """The choices that one core offers."""
        only = dict(self.only)
        return tuple(c for c in self.choices if only.get(c, core) == core)

    def check(self, value, technique, core):
        """Return `value` in the parameter's type.

        Raises
        ------
        ParameterError
            When it is of another type, not a choice, or out of range.
        """
        where = f"{technique}: parameter {self.name!r}"
        if self.choices:
            choices = self.choices_in(core)
            if str(value) not in choices:               # 14 and "14" are the same choice
                raise ParameterError(
                    f"{where} is one of {', '.join(choices)} (core {core!r}), not {value!r}.")
            return str(value)
        if self.type is bool:
            if isinstance(value, str) and value.lower() in ("true", "false", "on", "off", "1", "0"):
                return value.lower() in ("true", "on", "1")
            if value in (True, False, 0, 1):
                return bool(value)
            raise ParameterError(f"{where} is true or false, not {value!r}.")
        try:
            number = self.type(value)
            if number != float(value):
                raise ValueError
        except (TypeError, ValueError, OverflowError):
            kind = "a whole number" if self.type is int else "a number"
            raise ParameterError(f"{where} is {kind}, not {value!r}.") from None
        if (self.low is not None and number < self.low) or (self.high is not None and number > self.high):
            raise ParameterError(f"{where} lies between {self.low} and {self.high}"
                                 f"{' ' + self.unit if self.unit else ''}, not at {value!r}.")
        return number


def resolve(technique, parameters, given, core):
    """Fill in defaults and check what was given.

    Parameters
    ----------
    technique : str
        Name of the technique, for the error message.
    parameters : sequence of Parameter
    given : dict
        Keywords of the call.
    core : str

    Returns
    -------
    dict
        A value for every parameter.

    Raises
    ------
    ParameterError
        For an unknown name (the message lists the known ones) or a bad value.
    """
    known = {p.name: p for p in parameters}
    for name in given:
        if name not in known:
            raise ParameterError(f"{technique} has no parameter {name!r}{did_you_mean(name, known)}. "
                                 f"It has: {', '.join(known) or 'none'}.")
    return {name: p.check(given.get(name, p.default_in(core)), technique, core)
            for name, p in known.items()}


def did_you_mean(name, known):
    """`` (did you mean 'x'?)`` for the nearest known name, or nothing."""
    near = difflib.get_close_matches(str(name), list(known), 1)
    return f" (did you mean {near[0]!r}?)" if near else ""
