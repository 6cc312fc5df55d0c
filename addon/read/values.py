"""What a node socket carries over a surface: a constant, times a picture, times vertex colours.

Nodes that compute with colours are carried out on the pixels of a picture, which then replaces it; so a picture mixed
with a colour, brightened or put through a colour ramp is still one picture.
"""

from dataclasses import dataclass, field, replace

import numpy as np

from ...core.scene.material import Image

#: Rec. 709 luminance: how Blender makes a number of a colour.
LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


@dataclass
class Value:
    """A colour over a surface.

    Attributes
    ----------
    factor : ndarray, shape (4,)
        Linear RGBA; a number is grey.
    image : Image or None
    uv_name : str or None
        UV map of the picture, None for the one used in renders.
    vertex : bool
        Times the mesh's colour attribute,
    colour_name : str or None
        which is called so; None for the one used in renders.
    """

    factor: np.ndarray = field(default_factory=lambda: np.ones(4))
    image: Image | None = None
    uv_name: str | None = None
    vertex: bool = False
    colour_name: str | None = None

    @classmethod
    def constant(cls, x):
        """From a number, a vector, RGB or RGBA."""
        x = np.atleast_1d(np.asarray(x, float))
        return cls(np.array([*(x[:3] if len(x) >= 3 else [x[0]] * 3), x[3] if len(x) > 3 else 1.0]))

    @property
    def varies(self):
        """Whether it is more than a constant."""
        return self.image is not None or self.vertex

    def mean(self):
        """RGB, averaged over the picture; vertex colours count as white."""
        mean = self.factor[:3].copy()
        return mean if self.image is None else mean * self.image.pixels[..., :3].mean(axis=(0, 1), dtype=float)

    def number(self):
        """As a single number."""
        return float(self.mean() @ LUMINANCE)

    def pixels(self):
        """RGBA of the picture, or of the one constant pixel: shape (h, w, 4) or (4,)."""
        return self.factor if self.image is None else self.image.pixels * self.factor.astype(np.float32)


def grey(value):
    """A colour as a number that may vary: its luminance in all channels."""
    return pixelwise(lambda p: np.repeat((p[..., :3] @ LUMINANCE.astype(p.dtype))[..., None], 3, -1), [value])


def multiply(a, b, lost):
    """a times b; exact as long as only one of them has a picture and one vertex colours."""
    if (a.image is None or b.image is None) and not (a.vertex and b.vertex):
        # The picture's own side lends its names; alpha is the first one's.
        return Value(
            np.append(a.factor[:3] * b.factor[:3], a.factor[3]),
            a.image or b.image,
            a.uv_name or b.uv_name,
            a.vertex or b.vertex,
            a.colour_name or b.colour_name,
        )
    return pixelwise(lambda p, q: p[..., :3] * q[..., :3], [a, b], lost)


def pixelwise(function, values, lost=None):
    """Apply a function of colours pixel by pixel.

    Parameters
    ----------
    function : callable
        Takes RGBA arrays (..., 4), returns RGB (..., 3).
    values : list of Value
    lost : callable, optional
        Told in words what could not be kept.

    Returns
    -------
    Value
        Alpha is that of the first value with a picture.
    """
    first = next((v for v in values if v.image is not None), None)
    arrays = []
    for v in values:
        if v.vertex and lost:
            lost("vertex colours inside a calculation: white was used for them")
        if v.image is not None and not _same_grid(v, first):
            if lost:
                lost(f"the picture {v.image.name} in a calculation with {first.image.name}: its mean colour was used")
            v = Value.constant(v.mean())
        arrays.append(v.pixels())
    result = np.asarray(function(*arrays))
    if first is None:
        return Value.constant(result)
    shape = first.image.pixels.shape[:2]
    pixels = np.empty((*shape, 4), np.float32)
    pixels[..., :3] = result
    pixels[..., 3] = first.image.pixels[..., 3]
    return Value(np.ones(4), replace(first.image, pixels=pixels), first.uv_name)


def _same_grid(a, b):
    """Whether two pictures lie pixel on pixel."""
    p, q = a.image, b.image
    same_mapping = p.mapping is q.mapping or (
        p.mapping is not None and q.mapping is not None and np.allclose(p.mapping, q.mapping)
    )
    return p.pixels.shape == q.pixels.shape and p.extension == q.extension and a.uv_name == b.uv_name and same_mapping
