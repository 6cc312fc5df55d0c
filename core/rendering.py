"""Tracing a picture: :func:`trace`, and :class:`Rendering` for those who want to watch it grow.

Pictures are arrays whose row 0 is at the bottom, as in Blender.
"""

import math
import time
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module

import numpy as np

from .catalogue import ALL_RAYS, CORES, build, technique as technique_row
from .enclosed import enclosed
from .errors import Cancelled, MemoryEstimateError, Notice, ParameterError, SceneError
from .figures import PER_RAY, ray_figures
from .memory import free_memory
from .options import AUTOMATIC, PARAMETERS, STANDARD
from .parameters import resolve
from .scene.camera import check_size

#: Pass -> (values a pixel, type, value where nothing was met). Blender's float passes have single precision.
PASSES = {
    "combined": (4, np.float32, 0.0),
    "depth": (1, np.float32, math.inf),
    "normal": (3, np.float32, 0.0),
    "position": (3, np.float32, 0.0),
    "object_index": (1, np.int32, -1),
    "primitive_index": (1, np.int64, -1),
    "rays_per_pixel": (1, np.int32, 0),
    "n_it": (1, np.int64, 0),
    "n_ts": (1, np.int64, 0),
}
COUNTED_PASSES = ("n_it", "n_ts")

#: Share of the progress bar that building takes.
BUILDING = 0.1
#: Seconds between two calls of `progress`, at least: often enough to stop a run in time.
INTERVAL = 0.03


@dataclass
class Result:
    """A traced picture.

    Attributes
    ----------
    image : ndarray, shape (h, w, 4), float32
        Linear RGB and alpha, row 0 at the bottom. Alpha is 1 where the picture is done, and 0 outside the region and
        where a cancelled run did not get to.
    passes : dict of ndarray
        With row 0 at the bottom, too:
        ``combined`` (h, w, 4), the image, the mean of the samples;
        from the first sample of each pixel, of the first surface met whatever its alpha: ``depth`` (h, w), along the
        viewing axis, inf where nothing was met; ``normal`` (h, w, 3), the smooth unit normal on the viewer's side, and
        ``position`` (h, w, 3), both 0 where nothing was met; ``object_index``, ``primitive_index`` (h, w), -1 where
        nothing was met;
        summed over samples and all rays of the pixel: ``rays_per_pixel``, and where counted ``n_it``, ``n_ts`` (h, w).
    figures : dict
        ``T_B``: time to build the structures that were not given; ``T_R``: time to trace, s;
        for ``primary``, ``reflected``, ``refracted``, ``transparent`` (straight on through alpha), ``shadow`` a dict:
        ``technique``, ``rays``, ``hits``, and where counted ``N_IT``, ``N_TS``, ``N_ETS``, ``N_EETS`` per ray,
        ``r_ITM``, and with a threshold ``saved``: rays not traced, without those that they would have sent on.
        A shadow ray through glass counts once for each stretch between two surfaces.
    notices : list of Notice
        What is amiss but did not stop the run.
    structures : dict
        ``primary``, ``secondary``, ``shadow``: the structures used, as far as such rays were needed.
    cancelled : bool
    """

    image: np.ndarray
    passes: dict
    figures: dict = field(default_factory=dict)
    notices: list = field(default_factory=list)
    structures: dict = field(default_factory=dict)
    cancelled: bool = False


def trace(scene, *arguments, on_tile=None, **more):
    """Trace a picture as Whitted (1980) did.

    Parameters
    ----------
    scene, *arguments, **more
        As of :class:`Rendering`.
    on_tile : callable, optional
        Called as ``on_tile(x0, y0, x1, y1)`` when that part of the image holds new samples. Tiles come from the centre
        outwards; with several samples the whole picture gets one after the other, small ones several at once.

    Returns
    -------
    Result
        What was done when the run was stopped, too, once the structures were built.

    Raises
    ------
    SceneError
        Without a camera, for an impossible size or region.
    ParameterError
        For unknown names and values out of range.
    MemoryEstimateError
        When picture or structures would not fit into memory.
    Cancelled
        When stopped while structures were built.
    """
    rendering = Rendering(scene, *arguments, **more)
    for tile in rendering.tiles():
        if on_tile:
            on_tile(*tile)
    return rendering.result


class Rendering:
    """A picture in the making.

    The constructor checks everything and builds the structures; :meth:`tiles` traces. A thread may run it while another
    reads ``result.image``. What may be raised: see :func:`trace`.

    Parameters
    ----------
    scene : Scene
        With a camera.
    technique : str
        Serves the rays that `primary`, `shadow` and `secondary` leave to it; see :func:`~rayscope.core.techniques`.
    core : {"fast", "pure"}
    size : (int, int)
        Width and height in pixels.
    depth : int
        Reflections and refractions in a row, at most (H). Passing straight through a surface with alpha is none of
        them.
    samples : int
        Samples a pixel. With 1, rays go through the pixels' centres and lights cast hard shadows from their centres;
        with more, both are chosen at random, by a hash of pixel, sample and seed.
    seed : int
    primary, shadow, secondary : str or (str, dict), optional
        A technique, or one with its parameters, for camera rays; shadow rays; reflected, refracted and transparent
        rays. The same technique with the same parameters is built once.
    region : (int, int, int, int), optional
        x0, y0, x1, y1 in pixels from the bottom left corner: only x0 <= x < x1, y0 <= y < y1 is traced.
    index : Structure, optional
        Used in place of `technique`: a structure built over this scene, in this core.
    progress : callable, optional
        Called as ``progress(fraction)`` every few ten milliseconds; stops the run by raising
        :class:`~rayscope.core.errors.Cancelled`.
    count : bool
        Also count intersection tests and traversal steps.
    parameters : dict, optional
        Of `technique`.
    threshold : float
        Dynamic recursion control: reflected, refracted and transparent rays whose weight in their pixel is less, in
        every colour, are not traced (Hall and Greenberg 1983); 0, the default, traces all up to `depth`.
    roulette : bool
        Such a ray is traced with the probability weight / threshold, and then weighs `threshold` (Arvo and Kirk 1990):
        the mean over many samples is right, at the price of noise. Default False.
    sampling : {"stratified", "random"}
        The points of the pixel and of lights that the samples of a pixel, and the shadow rays of each, choose: spread
        evenly over pixel and light, or each by itself. Default stratified.
    antialiasing : {"uniform", "corners", "variance"}
        Where samples are taken: `samples` in each pixel; at the pixels' corners, and where these differ in colour,
        object or depth, at those of their quarters and so on (Whitted 1980); `samples`, but at least 4, in each pixel,
        and more where their variance is high. Both adaptive ways sample lights that have an extent. Default uniform.
    aa_threshold : float
        Difference in displayed values, 0 to 1, that is put up with: between the corners; as the standard error of a
        pixel with 4 samples, (n / 4)**0.75 of it with n, so that samples go where they take most from the error; more
        in noisy pictures (:class:`~rayscope.core.adaptive.ByVariance`). Default 0.033.
    aa_level : int
        Pixels between corners are divided into four so many times; by variance there are at most 4 * 4**aa_level
        samples a pixel. Default 3.
    light_samples : int
        Shadow rays to each light that has an extent, wherever a surface is shaded. With more than one, its shadows are
        soft also with one sample a pixel. Default 1.

    Attributes
    ----------
    result : Result
    """

    def __init__(
        self,
        scene,
        technique="bvh",
        core="fast",
        size=(640, 480),
        depth=5,
        samples=1,
        seed=0,
        primary=None,
        shadow=None,
        secondary=None,
        region=None,
        index=None,
        progress=None,
        count=False,
        parameters=None,
        **options,
    ):
        if core not in CORES:
            raise ParameterError(f"trace: there is no core {core!r}. Cores: {', '.join(CORES)}.")
        options = resolve("trace", PARAMETERS, {"depth": depth, "samples": samples, "seed": seed, **options}, core)
        self.scene, self.core, self.count = scene, core, bool(count)
        self.samples, antialiasing = options["samples"], options["antialiasing"]
        self.size = check_size(size)
        if scene.camera is None:
            raise SceneError(
                f"{scene.name}: there is no camera to see it from. Add one (in Blender: Add > Camera, "
                "then View > Cameras > Set Active Object as Camera)."
            )
        with np.errstate(all="ignore"):
            if not all(np.isfinite(v).all() for v in (*scene.camera.frame(), scene.camera.window)):
                raise SceneError(
                    f"{scene.camera.name}: it has no place or direction, or its picture no size (a scale of zero, NaN "
                    "or infinite numbers); reset its transform."
                )
        self.region = _check_region(region, self.size)
        names = [name for name in PASSES if self.count or name not in COUNTED_PASSES]
        self._progress, self._fraction, self._told = progress, 0.0, -math.inf
        self._standard, self._contenders = None, {}     # what an automatic choice starts from, and what it is not sure of
        wanted = self._wanted(technique, parameters, primary, shadow, secondary, index, options["depth"])
        passes = _framebuffer(self.size, names)
        self.result = Result(passes["combined"], passes, notices=_notices(scene))
        self._build(wanted, index)
        for structure in {id(s): s for s in self.result.structures.values()}.values():
            self.result.notices += structure.notices
        # A structure for all kinds of ray has nothing to build for a question like this.
        serves_all = [s for s in self.result.structures.values() if s.technique.rays == ALL_RAYS]
        if "shadow" in self.result.structures:
            self.result.notices += enclosed((serves_all or [self.result.structures["shadow"]])[0], scene)
        row = self.result.structures["primary"].technique
        tracer = row.load_tracer(core)
        if tracer.antialiases and (self.samples > 1 or antialiasing != "uniform"):
            self.samples, antialiasing = 1, "uniform"
            self.result.notices.append(
                Notice(row.name, "each pixel is traced as a whole, once: samples and antialiasing were left aside.")
            )
        samples = self.samples if antialiasing == "uniform" else 4 ** (1 + options["aa_level"])
        given = {**options, "samples": samples}
        self._tracer = tracer(scene, self.result.structures, self.size, given, self.count, self._check)
        self.result.notices += self._tracer.notices
        self._adaptive = None
        if antialiasing != "uniform":
            way = import_module(f".{core}.tracing.adaptive", __package__).WAYS[antialiasing]
            self._adaptive = way(self._tracer, self.region, options["aa_threshold"], options["aa_level"], self.samples)

    def _wanted(self, technique, parameters, primary, shadow, secondary, index, depth):
        """Kind of ray -> (technique, its parameters), or None for `index`; only the kinds that the scene needs."""
        if index is not None and hasattr(index, "closest_ray") != (self.core == "pure"):
            raise ParameterError(f"trace: the structure given as index is not of the core {self.core!r}.")
        if index is not None and parameters:
            raise ParameterError(
                "trace: parameters belong to a technique that is to be built, but index is built already."
            )
        materials = self.scene.used_materials()
        bounces = depth > 0 and any(m.reflects for m in materials)
        needed = {
            "primary": (primary, True),
            "secondary": (secondary, bounces or any(m.transparent for m in materials)),
            "shadow": (shadow, any(light.shadows and any(light.colour) for light in self.scene.lights)),
        }
        automatic = self._automatic(technique, index, needed, depth)
        wanted = {}
        for kind, (choice, need) in needed.items():
            choice = automatic.get(kind, choice)
            if choice is None and index is not None:
                wanted[kind] = None
                continue
            if choice is None or choice == technique:
                choice = (technique, parameters or {})
            name, given = (choice, {}) if isinstance(choice, str) else choice
            row = technique_row(name)
            if self.core not in row.cores:
                raise ParameterError(f"{name} has no core {self.core!r}. It has: {', '.join(row.cores)}.")
            wanted[kind] = name, resolve(name, row.parameters, given, self.core)
            if need and kind not in row.rays:
                raise ParameterError(
                    f"{name} serves {' and '.join(row.rays)} rays only; name another technique for {kind} rays."
                )
        return {kind: choice for kind, choice in wanted.items() if needed[kind][1]}

    def _automatic(self, technique, index, needed, depth):
        """Kind of ray -> technique, with no parameters, for the kinds that were left to us."""
        left = technique if index is None else None
        open_kinds = [kind for kind, (choice, _) in needed.items() if (left if choice is None else choice) == AUTOMATIC]
        kinds = [kind for kind in open_kinds if needed[kind][1]]
        chosen = {}
        if kinds:
            from .lab.needs import resolve_automatic

            self._standard = build(self.scene, STANDARD, self.core, progress=self._building)
            x0, y0, x1, y1 = self.region
            chosen = resolve_automatic(
                self.scene, self._standard, (x1 - x0, y1 - y0), self.samples, depth, self.core, kinds
            )
            if self.core == "fast" and not self.count:              # counters are those of one technique
                self._contenders = {kind: row for kind, row in chosen.items() if len(row[0]) > 1}
        return {kind: (chosen[kind][0][0][0] if kind in chosen else STANDARD, {}) for kind in open_kinds}

    def _build(self, wanted, index):
        """Build every different structure once."""
        # What serves some kinds of ray hands others on to the standard technique: where that is wanted too, to the same.
        plain = STANDARD, tuple(sorted(resolve(STANDARD, technique_row(STANDARD).parameters, {}, self.core).items()))
        built = {} if self._standard is None else {plain: self._standard}
        keys = {
            kind: None if choice is None else (choice[0], tuple(sorted(choice[1].items())))
            for kind, choice in wanted.items()
        }
        todo = list(dict.fromkeys(k for k in keys.values() if k is not None and k not in built))
        todo.sort(key=lambda key: key != plain)
        for i, key in enumerate(todo):
            report = partial(self._building, done=i, of=len(todo))
            built[key] = build(
                self.scene, key[0], self.core, progress=report, beside=built.get(plain), **dict(key[1])
            )
        self.result.structures = {kind: index if key is None else built[key] for kind, key in keys.items()}
        self._known = {name: own for (name, _), own in built.items()}
        for kind, (some, expected) in self._contenders.items():
            from .contest import Contest

            others = [(partial(self._tried, name), seconds) for name, seconds in some[1:]]
            self.result.structures[kind] = Contest(self.result.structures[kind], others, expected)
        self.result.figures["T_B"] = sum(s.figures["T_B"] for s in built.values())

    def _tried(self, name):
        """A structure to try, the same for all kinds of ray."""
        if name not in self._known:
            self._known[name] = build(
                self.scene, name, self.core, progress=lambda fraction: self._check(), beside=self._standard
            )
        return self._known[name]

    def _building(self, fraction, done=0, of=1):
        """The progress of a build."""
        self._fraction = BUILDING * (done + fraction) / of
        self._check()

    def _check(self):
        """Tell the progress, if it is time to."""
        if self._progress is None:
            return
        now = time.perf_counter()
        if now - self._told >= INTERVAL:
            self._told = now
            self._progress(min(self._fraction, 1.0))

    def tiles(self):
        """Trace, and yield (x0, y0, x1, y1) of each part of the image that holds a new sample.

        Ends early, with ``result.cancelled`` set, when `progress` raises Cancelled.
        """
        began = time.perf_counter()
        order = _tiles(self.region, self._tracer.tile_side)
        self._fraction, done = BUILDING, False
        try:
            self._check()
            for fraction, tile in self._refined(order) if self._adaptive else self._sampled(order):
                self._fraction = BUILDING + (1.0 - BUILDING) * fraction
                self._figures(began)
                yield tile
                self._check()
            done = True
            if self._progress:
                self._progress(1.0)
        except Cancelled:
            self.result.cancelled = not done
            self._figures(began)
        # Some is known only now.
        for kind in self._contenders:
            self.result.structures[kind] = self.result.structures[kind].leader
        told = [n for structure in self.result.structures.values() for n in structure.notices]
        self.result.notices += dict.fromkeys(n for n in (*told, *self._tracer.notices) if n not in self.result.notices)

    def _sampled(self, order):
        """Take as many samples everywhere; yield how much is done, and the tile."""
        x0, y0, x1, y1 = self.region
        pixels, before, done = (x1 - x0) * (y1 - y0), 0, 0
        while before < self.samples:
            # First something to see, then as many at once as are worth it.
            n = min(self._tracer.together // pixels, self.samples - before) if before else 1
            n = max(n, 1)
            numbers = range(before, before + n) if n > 1 else before
            for tile in order:
                self._keep(tile, before, n, self._tracer.tile(*tile, numbers))
                done += n * (tile[2] - tile[0]) * (tile[3] - tile[1])
                yield done / (pixels * self.samples), tile
            before += n

    def _refined(self, order):
        """Take samples where they are needed; yield how much is done, and the tile."""
        for fraction, tile, values, (pixels, spent) in self._adaptive.parts(order):
            self._keep(tile, 0, 1, values)
            for name, cost in spent.items():
                target = self.result.passes[name].reshape(-1)
                np.add.at(target, pixels, np.asarray(cost, target.dtype))
            yield fraction, tile

    def _keep(self, tile, before, n, values):
        """Put n samples of a tile into the framebuffer, which holds `before` of them."""
        x0, y0, x1, y1 = tile
        shape = (y1 - y0, x1 - x0)
        for name, value in values.items():
            target = self.result.passes[name][y0:y1, x0:x1]
            value = (
                np.asarray(value).reshape(*shape, *target.shape[2:-1], -1)
                if target.ndim == 3
                else np.reshape(value, shape)
            )
            if name == "combined":
                # The mean so far; a picture stopped now is complete.
                with np.errstate(invalid="ignore", over="ignore"):  # what glows without end
                    more = (value - target[..., :3]) * (n / (before + n))
                    target[..., :3] = target[..., :3] + more if before else value
                target[..., 3] = 1.0
            elif name in ("rays_per_pixel", *COUNTED_PASSES):
                target += value.astype(target.dtype)
            else:
                with np.errstate(over="ignore"):
                    target[...] = value

    def _figures(self, began):
        """Bring the figures up to date."""
        figures = self.result.figures
        figures["T_R"] = time.perf_counter() - began
        for kind, tally in self._tracer.tally.items():
            structure = self.result.structures.get(kind if kind in ("primary", "shadow") else "secondary")
            row = {
                "technique": structure.technique.name if structure else None,
                "rays": tally["rays"],
                "hits": tally["hits"],
            }
            if self._tracer.threshold:
                row["saved"] = tally["saved"]
            if self.count:
                row |= ray_figures(*(tally[name] for name in PER_RAY), tally["rays"], tally["hits"])
            figures[kind] = row


def _check_region(region, size):
    """The region, or the whole picture."""
    width, height = size
    if region is None:
        return 0, 0, width, height
    try:
        x0, y0, x1, y1 = (int(v) for v in region)
    except (TypeError, ValueError):
        raise SceneError(f"Region: four whole numbers are needed, x0, y0, x1, y1, not {region!r}.") from None
    if not (0 <= x0 < x1 <= width and 0 <= y0 < y1 <= height):
        raise SceneError(
            f"Region: {x0}, {y0}, {x1}, {y1} is empty or reaches out of the picture of {width} x {height} pixels."
        )
    return x0, y0, x1, y1


def _framebuffer(size, names):
    """The passes, empty."""
    width, height = size
    need = width * height * sum(PASSES[n][0] * np.dtype(PASSES[n][1]).itemsize for n in names)
    there = free_memory()
    if need > 0.75 * there:
        raise MemoryEstimateError(
            f"Picture of {width} x {height} pixels: its passes would take {need / 2**30:.1f} GiB of the "
            f"{there / 2**30:.1f} GiB of memory; choose a smaller resolution."
        )
    return {
        name: np.full((height, width) if k == 1 else (height, width, k), empty, dtype)
        for name, (k, dtype, empty) in ((n, PASSES[n]) for n in names)
    }


def _notices(scene):
    """What is amiss with a scene that shall be traced."""
    if any(any(light.colour) for light in scene.lights):
        return []
    return [
        Notice(
            scene.name,
            "no light shines; the picture shows emission, ambient light and the surroundings alone. "
            "Add a light (in Blender: Add > Light).",
        )
    ]


def _tiles(region, side):
    """Tiles of a region, from the centre outwards."""
    x0, y0, x1, y1 = region
    tiles = [(x, y, min(x + side, x1), min(y + side, y1)) for y in range(y0, y1, side) for x in range(x0, x1, side)]
    return sorted(tiles, key=lambda t: math.hypot(t[0] + t[2] - x0 - x1, t[1] + t[3] - y0 - y1))
