"""How long a run will take and how much memory it will need, before it starts.

Rough on purpose: right to a factor of about three, which is what one needs to know before waiting. The constants were
measured in Python 3.13 on bumpy spheres of 200 to 32 000 triangles lit by one lamp, on a machine where
:func:`machine_seconds` is `MACHINE`. The pure core is scaled by that of the machine at hand; the numpy core, whose
speed differs less between machines and versions of Python, is not.
"""

import math
import time
from dataclasses import dataclass

from ..catalogue import technique as row_of
from ..errors import MemoryEstimateError
from ..memory import free_memory

#: Seconds of the reference loop on the machine where the constants were measured.
MACHINE = 1.5e-3


@dataclass(frozen=True)
class Cost:
    """What a technique costs in one core, in microseconds and bytes.

    Techniques that trace other things than rays go through the whole scene for a picture, however small it is.

    Parameters
    ----------
    build : float
        Microseconds a primitive.
    ray, growth : float
        Microseconds a ray: ``ray + growth * g(N)``.
    g : callable
        How the cost of a ray grows with the number of primitives N.
    memory : float
        Bytes a primitive.
    picture : float
        Microseconds a primitive, once a picture.
    """

    build: float
    ray: float
    growth: float
    g: object
    memory: float
    picture: float = 0.0


def _linear(n):
    return n


def _cube_root(n):
    return n ** (1.0 / 3.0)


def _log(n):
    return math.log2(n + 1.0)


COSTS = {
    ("brute", "fast"): Cost(0.3, 3.0, 0.15, _linear, 200),
    ("brute", "pure"): Cost(5.0, 20.0, 1.2, _linear, 500),
    ("bvh", "fast"): Cost(2.0, 1.0, 0.15, _log, 500),
    ("bvh", "pure"): Cost(300.0, 60.0, 6.0, _log, 2500),
    ("grid", "fast"): Cost(4.0, 3.0, 0.15, _cube_root, 3000),
    ("grid", "pure"): Cost(230.0, 60.0, 2.0, _cube_root, 700),
    ("octree", "fast"): Cost(15.0, 4.0, 0.3, _cube_root, 3000),
    ("octree", "pure"): Cost(700.0, 60.0, 6.0, _log, 2000),
    ("kd-tree", "fast"): Cost(80.0, 6.0, 0.8, _cube_root, 2500),
    ("kd-tree", "pure"): Cost(1200.0, 70.0, 10.0, _log, 6000),
    ("beams", "fast"): Cost(1.0, 5.0, 0.0, _log, 1200, 1500.0),
    ("beams", "pure"): Cost(20.0, 50.0, 0.0, _log, 2500, 5000.0),
    ("pyramids", "fast"): Cost(15.0, 5.0, 0.0, _log, 400, 1000.0),
    ("pyramids", "pure"): Cost(1250.0, 150.0, 5.0, _log, 2500, 1000.0),
    ("cones", "fast"): Cost(10.0, 3.0, 2.2, _cube_root, 400),
    ("cones", "pure"): Cost(1250.0, 150.0, 5.0, _log, 2500),
    ("embree", "fast"): Cost(3.0, 1.0, 0.03, _log, 200),
    ("mathutils", "fast"): Cost(2.5, 3.0, 0.1, _log, 900),
}
#: For techniques not measured: a tree of its core.
OTHERS = {"fast": COSTS["octree", "fast"], "pure": COSTS["octree", "pure"]}

#: Bytes a pixel: the picture and the passes, with a batch of rays under way.
PIXEL = 120


@dataclass(frozen=True)
class Estimate:
    """Seconds and bytes of a run, and what it consists of.

    Attributes
    ----------
    seconds, bytes : float
    primitives, rays : int
    """

    seconds: float
    bytes: float
    primitives: int
    rays: int

    def lines(self):
        """The estimate in words."""
        work = f"{self.primitives:,} primitives" + (f", {self.rays:,} rays" if self.rays else "")
        return [f"This will take about {duration(self.seconds)} and {self.bytes / 1e6:,.0f} MB of memory ({work}).",
                "Esc stops it and keeps what was done."]

    def check_memory(self):
        """Raise a MemoryEstimateError if there is less memory than it needs."""
        free = free_memory()
        if self.bytes > free:
            raise MemoryEstimateError(
                f"About {self.bytes / 1e9:.1f} GB of memory would be needed for {self.primitives:,} primitives and {self.rays:,} rays, but "
                f"{free / 1e9:.1f} GB are free: use fewer primitives, a coarser structure or a smaller picture.")
        return self


def estimate(scene, technique="bvh", core="fast", size=None, samples=1, depth=5, antialiasing="uniform", aa_threshold=0.033, aa_level=3,
             light_samples=1, threshold=0.0, **others):
    """Estimate a build, and with a `size` the picture too.

    Parameters
    ----------
    scene : Scene
    technique : str
    core : {"fast", "pure"}
    size : tuple of int, optional
        Width and height of the picture; only the build if absent.
    samples, depth, antialiasing, aa_threshold, aa_level, light_samples, threshold
        Of the picture, as of :class:`~rayscope.core.rendering.Rendering`.
    **others
        Its other options, which do not change what it takes.

    Returns
    -------
    Estimate
    """
    from ..scene.layout import Layout
    row = row_of(technique)
    cost = COSTS.get((row.name, core), OTHERS[core])
    layout = Layout.of(scene.objects)
    # A mesh that instances share is stored once.
    shared = {id(scene.objects[i].geometry): scene.objects[i].geometry for i in layout.instances}
    stored = (sum(len(scene.objects[i].geometry) for i in layout.meshes) + len(layout.shapes) + len(layout.instances)
              + sum(len(mesh) for mesh in shared.values()))
    rays, pixels = 0, 0
    if size is not None:
        pixels = size[0] * size[1]
        taken = _samples(samples, antialiasing, aa_threshold, aa_level) if row.ray_by_ray else 1   # others trace a pixel as a whole
        to_lights = sum(light_samples if light.has_extent and row.ray_by_ray else 1 for light in scene.lights)
        rays = int(pixels * taken * (1 + to_lights) * _generations(scene, depth, threshold))
    seconds = 1e-6 * (stored * cost.build + rays * (cost.ray + cost.growth * cost.g(scene.n_primitives)) + (pixels > 0) * scene.n_primitives * cost.picture)
    if core == "pure":
        seconds *= machine_seconds() / MACHINE
    return Estimate(seconds, stored * cost.memory + pixels * PIXEL, scene.n_primitives, rays)


#: Share of the pixels whose corners differ at a threshold of 0.03, and samples that the variance asks for there, on
#: average; about as on the interior among the examples.
UNEVEN, ASKED = 0.35, 6.0


def _samples(samples, antialiasing, threshold, level):
    """Samples a pixel, on average."""
    if antialiasing == "uniform":
        return samples
    finer, most = 0.03 / max(threshold, 1e-6), 4**level
    if antialiasing == "variance":
        # Errors of n samples below n^0.75 times the threshold need so many.
        return min(max(samples, 4, ASKED * finer**0.8), 4 * most)
    # Pixels are divided down to the end where there is an edge; a threshold ten times as fine finds three times as many.
    return 1 + min(1.0, UNEVEN * math.sqrt(finer)) * (most - 1)


def _generations(scene, depth, threshold):
    """How many times the primary rays' number is traced: mirrors and glass send rays on from where they are seen."""
    materials = scene.used_materials()
    if not any(m.mirror or m.mirror_base or m.transmission for m in materials):
        return 1.0
    if threshold > 0.0:                                                     # about a half of the light is sent on each time
        depth = min(depth, math.log2(1.0 / min(threshold, 1.0)))
    return 1.0 + min(depth, 4) * 0.5


def machine_seconds():
    """Seconds of a fixed loop in Python: the best of three."""
    best = math.inf
    for _ in range(3):
        start = time.perf_counter()
        x = 0.0
        for i in range(20_000):
            x = x * 0.5 + i
        best = min(best, time.perf_counter() - start)
    return best


def duration(seconds):
    """Seconds as a person says them."""
    if seconds < 10:
        return f"{seconds:.2g} s"
    if seconds < 90:
        return f"{seconds:.0f} s"
    if seconds < 5400:
        return f"{seconds / 60:.0f} min"
    return f"{seconds / 3600:.1f} h"
