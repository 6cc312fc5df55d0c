"""A finding: whom it is about, what was found, what to do, what that brings."""

from dataclasses import dataclass, field


@dataclass
class Finding:
    """One cause of cost, or one risk.

    Attributes
    ----------
    objects : list of str
        Their names.
    cause : str
        One or two words; see `CAUSES`.
    text : str
        What was found, with its number.
    remedy : str
        In Blender's words.
    number : float
    gain : float or None
        Share of the tests and steps of the picture that the remedy saves; None where it was not tried.
    memory : float
        Bytes saved, about.
    same : bool
        It is a finding only if the picture is the same with the remedy: what it concerns stopped shadow rays that
        others stop, too.
    """

    objects: list
    cause: str
    text: str
    remedy: str
    number: float
    gain: float = None
    memory: float = 0.0
    same: bool = False
    apply: object = field(default=None, repr=False, compare=False)


def merged(findings):
    """One finding for all instances of an object, which have its name."""
    found = {}
    for f in findings:
        found.setdefault((f.cause, *f.objects), []).append(f)
    for some in found.values():
        some[0].memory = sum(f.memory for f in some)
        some[0].text += f"; so are {len(some) - 1} other instances" if len(some) > 1 else ""
    return [some[0] for some in found.values()]


def as_dict(finding):
    """A finding for JSON."""
    return {name: getattr(finding, name) for name in ("objects", "cause", "text", "remedy", "number", "gain", "memory")}
