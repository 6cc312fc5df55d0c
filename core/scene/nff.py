"""Reader of the Neutral File Format (Haines 1987), in which the Standard Procedural Databases are written.

All primitives become solids of one object, in the file's order. The format's coefficients become ours like this:

==============  ========================================================================================================
NFF             here
==============  ========================================================================================================
r g b, Kd       base colour, diffuse
Ks, Shine       white highlight of this strength and exponent; mirror of this strength
T, ior          transmission, index of refraction; constants, without Fresnel
light           point light without falloff; of n lights each gives 1 / sqrt(n): irradiance pi / sqrt(n) times its colour
background      the world's colour; there is no ambient light
c               cylinder or cone without caps
pp              smooth triangles; a patch of more corners is divided into such
==============  ========================================================================================================
"""

import gzip
import math
import zlib
from pathlib import Path

from ..errors import Notice, SceneError
from . import solids
from .camera import Camera
from .light import Light
from .material import Material, World
from .scene import Object, Scene, Shapes

#: Unreadable lines that are named one by one.
NAMED = 20


def read_nff(path):
    """Read a scene from a file, packed (.gz) or not.

    Parameters
    ----------
    path : path-like

    Returns
    -------
    Scene
        A line that cannot be read is left out and named in ``scene.notices``, with its number.

    Raises
    ------
    SceneError
        When there is no such file, it cannot be read, or it holds nothing of an NFF scene.
    """
    path = Path(path)
    try:
        data = path.read_bytes()
        if data[:2] == b"\x1f\x8b":
            data = gzip.decompress(data)
    except FileNotFoundError:
        raise SceneError(f"{path}: there is no such file.") from None
    except (OSError, EOFError, zlib.error) as error:
        raise SceneError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}.") from None
    return Reader(path.name, data.decode("utf-8", "replace")).scene()


def scene_of(name, shapes, fills, lights, background, camera, notices=()):
    """The scene that NFF's numbers describe.

    Parameters
    ----------
    name : str
    shapes : list of Solid
    fills : sequence of 8 numbers each
        r, g, b, Kd, Ks, Shine, T, ior: the materials in the order of the solids' slots.
    lights : list of (position, colour)
    background : triple
    camera : Camera or None
    notices : sequence of Notice

    Returns
    -------
    Scene
    """
    share = math.pi / math.sqrt(max(len(lights), 1))
    lights = [Light(f"Light {k + 1}", "point", tuple(share * c for c in colour), position=tuple(position), falloff=False)
              for k, (position, colour) in enumerate(lights)]
    materials = tuple(_material(k, *fill) for k, fill in enumerate(fills)) or (Material("Fill"),)
    objects = [Object(name, Shapes(shapes, name), materials=materials)] if shapes else []
    return Scene(objects, lights, camera, World(colour=tuple(background), ambient=(0.0, 0.0, 0.0)), name=name, notices=list(notices))


def _material(number, r, g, b, diffuse, specular, shininess, transmission, ior):
    """The material of a fill line."""
    return Material(f"Fill {number + 1}", base=(r, g, b), ambient=diffuse, diffuse=diffuse, specular=specular, shininess=shininess,
                    mirror=specular, transmission=transmission, ior=ior if ior > 0.0 else 1.0)


class _Unreadable(Exception):
    """A line does not say what its keyword needs."""


class Reader:
    """One pass over the text of a file.

    Parameters
    ----------
    name : str
        Of the file, for notices.
    text : str
    """

    #: Keyword of a line -> what reads it; the keywords of the view stand on lines of their own.
    VIEW = {"from": 3, "at": 3, "up": 3, "angle": 1, "hither": 1, "resolution": 2}

    def __init__(self, name, text):
        self.name, self.lines, self.at = name, text.splitlines(), 0
        self.view, self.lights, self.solids, self.notices, self.unnamed = {}, [], [], [], 0
        self.background, self.fills, self.slot = (0.0, 0.0, 0.0), {}, 0
        self.readers = {"b": self._background, "l": self._light, "f": self._fill, "s": self._sphere, "c": self._cone,
                        "p": self._polygon, "pp": self._patch, "v": lambda words: None}

    def scene(self):
        """Read everything."""
        known = 0
        while self.at < len(self.lines):
            here, line = self.at, self.lines[self.at]
            self.at += 1
            words = self._words(here)
            if not words:
                continue
            try:
                if words[0] in self.VIEW:
                    self.view[words[0]] = self._numbers(words[1:], self.VIEW[words[0]])
                elif words[0] in self.readers:
                    self.readers[words[0]](words[1:])
                else:
                    raise _Unreadable(f"there is no keyword {words[0][:20]!r}")
                known += 1
            except _Unreadable as error:
                self._left_out(here, line, error)
                # Lines that belong to what was left out.
                while self.at < len(self.lines) and words[0] in ("p", "pp", "c") and not self._known((self._words(self.at) or [""])[0]):
                    self.at += 1
        if not known:
            raise SceneError(f"{self.name}: this is no NFF scene, not one of its {len(self.lines)} lines can be read.")
        return self._finish()

    def _finish(self):
        """The scene from what was read."""
        if self.unnamed:
            self.notices.append(Notice(self.name, f"{self.unnamed} more lines cannot be read; they were left out."))
        return scene_of(self.name, self.solids, self.fills, self.lights, self.background, self._camera(), self.notices)

    def _camera(self):
        """The camera, or None when the view is incomplete."""
        missing = [word for word in ("from", "at", "up", "angle") if word not in self.view]
        if missing:
            self.notices.append(Notice(self.name, f"the view (v) lacks {', '.join(missing)}; there is no camera."))
            return None
        width, height = self.view.get("resolution", (1.0, 1.0))
        angle = self.view["angle"][0]
        if not 0.0 < angle < 180.0 or not (width > 0.0 and height > 0.0):
            self.notices.append(Notice(self.name, f"the view's angle ({angle:g}) lies between 0 and 180 degrees, its resolution "
                                       f"({width:g} {height:g}) above 0; there is no camera."))
            return None
        try:
            return Camera.look_at(self.view["from"], self.view["at"], self.view["up"], math.radians(angle), width / height,
                                  near=max(self.view.get("hither", (0.0,))[0], 0.0), name="View")
        except SceneError as error:
            self.notices.append(Notice(self.name, f"{error} There is no camera."))
            return None

    def _left_out(self, number, line, error):
        """Name an unreadable line; of very many, only their number."""
        if len(self.notices) >= NAMED:
            self.unnamed += 1
            return
        text = line.strip()
        text = text if len(text) <= 60 else text[:57] + "..."
        self.notices.append(Notice(f"{self.name}, line {number + 1}", f"{error}: {text!r}; it was left out."))

    @staticmethod
    def _numbers(words, *counts):
        """The finite numbers of a line, of which there are as many as one of `counts` says."""
        try:
            numbers = tuple(map(float, words))
        except ValueError:
            raise _Unreadable("not all of its values are numbers") from None
        if len(numbers) not in counts:
            raise _Unreadable(f"it has {len(numbers)} numbers, not {' or '.join(map(str, counts))}")
        if not all(map(math.isfinite, numbers)):
            raise _Unreadable("one of its values is NaN or infinite")
        return numbers

    def _background(self, words):
        self.background = self._numbers(words, 3)

    def _light(self, words):
        numbers = self._numbers(words, 3, 6)
        self.lights.append((numbers[:3], numbers[3:] or (1.0, 1.0, 1.0)))

    def _fill(self, words):
        self.slot = self.fills.setdefault(self._numbers(words, 8), len(self.fills))

    def _sphere(self, words):
        x, y, z, radius = self._numbers(words, 4)
        self.solids.append(solids.sphere((x, y, z), radius, slot=self.slot))

    def _cone(self, words):
        # On this line, or each end on a line of its own.
        while len(words) < 8:
            words = words + self._next_line()
        numbers = self._numbers(words, 8)
        base, base_radius, apex, apex_radius = numbers[:3], abs(numbers[3]), numbers[4:7], abs(numbers[7])
        if base_radius == apex_radius:
            self.solids.append(solids.cylinder(base, apex, base_radius, capped=False, slot=self.slot))
        else:
            self.solids.append(solids.cone(base, apex, base_radius, apex_radius, capped=False, slot=self.slot))

    def _polygon(self, words):
        self.solids.append(solids.polygon(self._corners(words, 3), slot=self.slot))

    def _patch(self, words):
        corners = self._corners(words, 6)
        self.solids += solids.patch([c[:3] for c in corners], [c[3:] for c in corners], slot=self.slot)

    def _corners(self, words, width):
        """The corners of a polygon, each on a line of its own."""
        count = self._numbers(words, 1)[0]
        if count != int(count) or count < 0:
            raise _Unreadable("the number of corners is a whole number")
        rows = []
        for _ in range(int(count)):
            words = self._next_line()
            try:
                rows.append(self._numbers(words, width))
            except _Unreadable as error:
                raise _Unreadable(f"one of its corners, line {self.at}, cannot be read: {error}") from None
        return rows

    def _next_line(self):
        """The words of the line that follows, which must not be one with a keyword."""
        words = self._words(self.at) if self.at < len(self.lines) else None
        if words is None or words and self._known(words[0]):
            raise _Unreadable("the file ends too early" if words is None else f"line {self.at + 1} begins something else too early")
        self.at += 1
        return words

    def _words(self, number):
        """The words of a line; what follows a # is a remark."""
        return self.lines[number].split("#", 1)[0].split()

    def _known(self, word):
        """Whether a line begins something."""
        return word in self.VIEW or word in self.readers
