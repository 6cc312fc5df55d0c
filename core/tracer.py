"""What the tracers of both cores have in common: what they are given, and what they know before the first ray."""

#: Rounding of positions on rays, relative to the scene's largest coordinate.
ROUNDING = 32 * 2.0**-52

PRIMARY, REFLECTED, REFRACTED, TRANSPARENT, SHADOW = range(5)
KINDS = ("primary", "reflected", "refracted", "transparent", "shadow")
#: What is counted of each ray: intersection tests, traversal steps, of those elementary cells, of those empty ones.
COUNTED = ("n_it", "n_ts", "n_ets", "n_eets")


class Tracer:
    """The tracer of one picture.

    Parameters
    ----------
    scene : Scene
    structures : dict
        ``primary``, ``secondary``, ``shadow``: the structure that answers each kind of ray.
    size : (int, int)
    options : dict
        A value for each of :data:`~rayscope.core.options.PARAMETERS`; ``samples`` are those that the picture will have.
    count : bool
        Also count intersection tests and traversal steps.
    check : callable
        Called without arguments every few ten milliseconds; may raise Cancelled.

    Attributes
    ----------
    tally : dict
        Per kind of ray: rays, hits, n_it, n_ts, n_ets, n_eets, and saved: rays not traced for their small weight.
    tile_side : int
        Side of the tiles that the picture is best made in.
    together : int
        Primary rays that are worth to be traced at once, where a picture has fewer pixels.
    antialiases : bool
        Whether one sample a pixel is the whole picture.
    notices : sequence of Notice
        What cannot be done as asked.
    """

    tile_side = 1
    together = 1
    antialiases = False
    notices = ()

    def __init__(self, scene, structures, size, options, count, check):
        self.scene, self.size, self.count, self.check = scene, size, count, check
        self.depth, self.samples, self.seed = options["depth"], options["samples"], options["seed"]
        self.threshold = options["threshold"]
        self.roulette = options["roulette"] and self.threshold > 0.0
        self.stratified = options["sampling"] == "stratified"
        self.to_light = {}
        self.tally = {kind: dict.fromkeys(("rays", "hits", "saved", *COUNTED), 0) for kind in KINDS}
        materials = scene.used_materials()
        self.bounces = self.depth > 0 and any(m.reflects for m in materials)
        self.transparent = any(m.transparent for m in materials)
        #: For each object whether some of it lets light through.
        self.lets_light = [any(m.transparent or m.refracts for m in o.materials) for o in scene.objects]
        self.coloured_shadows = any(self.lets_light)
        lights, n = [light for light in scene.lights if any(light.colour)], options["light_samples"]
        #: A light that is sampled n times is there n times, by 1 / n.
        self.lights = [(light, 1.0 / k) for light in lights for k in (n if light.has_extent else 1,) for _ in range(k)]
        self.soft = (self.samples > 1 or n > 1) and any(light.has_extent for light in lights)
        self.rounding = 0.0
        if "shadow" in structures:
            self.rounding = ROUNDING * max(abs(x) for corner in scene.bounds() for x in corner.tolist())
