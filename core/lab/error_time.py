"""Error against run time: what each setting costs and how wrong its picture is (a work-precision diagram).

Every knob that the scene has something for is swept, each setting traced several times, turn by turn with all others.
The reference is a picture with at least `FINER` times the samples of the finest setting, in two halves with different
random numbers: half their difference is its own error, below which nothing can be told apart. That the error of random
samples falls with the root of their number is the check on it all.

Techniques that trace the same rays are compared with the picture of the same samples: exact ones have no error.
"""

import base64
import html
import math
import time
from dataclasses import dataclass, field

import numpy as np

from ..catalogue import build
from ..errors import Cancelled, MemoryEstimateError, MissingPackageError, RayscopeError, SceneError
from ..rendering import trace
from . import report
from .picture_error import MEASURES, STEP, displayed, errors

#: The reference has so many times the samples of the finest setting.
FINER = 16
#: Cost of the whole run for each sample a pixel of the finest setting: the reference, the counting and the timed runs.
RUNS = FINER + 50
#: Samples a pixel that are worth sweeping up to.
MOST, FEWEST = 1024, 2
#: Points measured however little time there is.
FEWEST_POINTS = 4
#: Timed runs of each setting.
REPEATS = 3
#: A setting that takes so many times what was reckoned is given up.
OVERTIME = 8.0
#: What ends the paths in all pictures that are not about that, without a bias, and the depths that are tried.
UNBIASED = {"threshold": 0.003, "roulette": True}
DEPTHS = (8, 16, 32, 64, 128, 256)
#: Techniques of the same samples: exact ones, and those that find triangles in float32.
TECHNIQUES, FLOAT32 = ("kd-tree", "grid", "octree"), ("embree", "mathutils")
#: What random sampling is checked by: slope of error against samples, and how far it may be off, relatively.
SLOPE, SLACK = -0.5, 0.15
#: What columns mean, for the page.
ABOUT = {
    **MEASURES,
    "T": "run time in seconds, the least of all runs",
    "T_worst": "run time in seconds, the most of all runs",
    "runs": "timed runs, taking turns with all other settings",
    "rays": "rays of all kinds",
    "tests": "intersection tests ray x primitive",
    "against": "what the error is against: the reference; or, for techniques, the picture of the same samples",
    "verdict": "another setting of the same knob that is faster and no less exact",
}
COLUMNS = ("curve", "setting", "T", "T_worst", "runs", "rays", "tests", *MEASURES, "against", "verdict")


@dataclass
class Setting:
    """One point of a curve.

    Attributes
    ----------
    curve, label : str
    knob : str
        Settings of one knob are judged against each other: they differ in it alone.
    options : dict
        Keywords of :func:`~rayscope.core.trace`.
    scene : int
        0: as it is; n: its curved solids as meshes, n segments around.
    technique : str
        What traces it, where that is not the technique of the whole run.
    same : bool
        Its error is against the picture that the technique of the whole run makes of the same samples.
    times : list of float
        Seconds of the timed runs, tracing alone.
    rays, tests : int
        Of all kinds; intersection tests ray x primitive.
    error : dict
        See :func:`~.picture_error.errors`.
    why : str
        It could not be measured, if it could not.
    verdict : str
    """

    curve: str
    label: str
    knob: str
    options: dict
    scene: int = 0
    technique: str = ""
    same: bool = False
    times: list = field(default_factory=list)
    rays: int = 0
    tests: int = 0
    error: dict = field(default_factory=dict)
    why: str = ""
    verdict: str = ""

    def row(self):
        """As a row of the table."""
        return {
            "curve": self.curve,
            "setting": self.label,
            "T": min(self.times),
            "T_worst": max(self.times),
            "runs": len(self.times),
            "times": list(self.times),
            "rays": self.rays,
            "tests": self.tests,
            **self.error,
            "against": "same samples" if self.same else "reference",
            "verdict": self.verdict,
            "options": {**self.options, **({"technique": self.technique} if self.technique else {})},
        }


def error_time(scene, size=(96, 72), seconds=120.0, seed=0, technique="bvh", progress=None, say=lambda line: None):
    """Sweep all knobs that a scene has something for.

    Parameters
    ----------
    scene : Scene
        With a camera.
    size : (int, int)
    seconds : float
        About how long it may take: decides how many samples the finest settings have.
    seed : int
    technique : str
    progress : callable, optional
        Called as ``progress(fraction)``; stops the run by raising Cancelled. What was measured by then is kept, once
        there is a reference.
    say : callable
        Called with a line of text now and then.

    Returns
    -------
    dict
        rows : list of dict, a setting each, with the keys `COLUMNS`, ``times`` and ``options``; floor : float, the
        reference's own RMSE; slopes : dict, curve -> slope of its error against samples, log-log; reference : dict;
        left_out : list of str; words : list of str; stopped : bool.

    Raises
    ------
    SceneError
        Without anything to trace, or without a camera.
    Cancelled
        When stopped before there was a reference.
    """
    if not scene.n_primitives:
        raise SceneError(
            f"{scene.name}: there is nothing to trace: no object with a surface. "
            "Add a mesh, or check what is hidden in renders."
        )
    sweep = _Sweep(scene, size, seconds, seed, technique, progress, say)
    return sweep.run()


def _shadow_rays(n):
    return f"{n} shadow ray{'s' * (n > 1)}"


class _TooLong(Exception):
    """A setting takes far longer than there is time for."""


class _Sweep:
    """The run of :func:`error_time`."""

    def __init__(self, scene, size, seconds, seed, technique, progress, say):
        self.size, self.seconds, self.seed, self.technique, self.progress, self.say = (
            size,
            seconds,
            seed,
            technique,
            progress,
            say,
        )
        self.scenes, self.indices = {0: scene}, {(0, ""): build(scene, technique)}
        #: The picture that techniques of the same samples are compared with.
        self.same = None
        self.began = time.perf_counter()
        self.done, self.total = 0.0, 1.0
        self.full = self._deep_enough()

    def run(self):
        """See :func:`error_time`."""
        cost = self._cost_of_a_sample()
        finest = 2 ** int(math.log2(min(max(self.seconds / (cost * RUNS), FEWEST), MOST)))
        settings, left_out = self._settings(finest)
        # In samples a pixel: for the progress.
        work = [self._work(s, finest) for s in settings]
        self.total = FINER * finest + (1.5 + REPEATS) * sum(work)
        self.say(f"paths are followed to depth {self.full['depth']}; a sample of all pixels takes {cost:.2g} s")
        self.say(f"{len(settings)} settings up to {finest} samples a pixel; reference with {FINER * finest}")
        least = cost * (FINER * finest + 2.5 * FEWEST_POINTS * FEWEST)
        if least > self.seconds:
            self.say(f"the reference and {FEWEST_POINTS} settings are the least there is: about {least:.0f} s")
        halves = [
            self._traced({**self.full, "samples": FINER * finest // 2}, self.seed + 1 + k, work=FINER * finest / 2)
            for k in (0, 1)
        ]
        images = [np.asarray(h.image, float) for h in halves]
        reference = 0.5 * (images[0] + images[1])
        floor = 0.5 * math.sqrt(np.mean((displayed(images[0]) - displayed(images[1])) ** 2))
        stopped = False
        try:
            self._measure(settings, work, reference, cost)
            if self.progress:
                self.progress(1.0)
        except Cancelled:
            stopped = True
        missing = {}
        for s in settings:
            if not s.times:
                why = s.why or ("stopped before." if stopped else "no time was left.")
                missing.setdefault((s.curve, why), []).append(s.label)
        left_out += [f"{curve}: {', '.join(labels)}: {why}" for (curve, why), labels in missing.items()]
        settings = [s for s in settings if s.times]
        slopes = _slopes(settings, floor)
        words = _judged(settings, floor) + _converged(slopes) + _alike(settings)
        return {
            "rows": [s.row() for s in settings],
            "floor": floor,
            "slopes": slopes,
            "reference": {
                "samples": FINER * finest,
                "options": self.full,
                "seeds": [self.seed + 1, self.seed + 2],
                "T": sum(h.figures["T_R"] for h in halves),
            },
            "left_out": left_out,
            "words": words,
            "stopped": stopped,
        }

    def _deep_enough(self):
        """Options that follow all paths: so deep that twice as deep the picture is the same, to a quarter of 1/255."""
        if not any(m.reflects or m.transparent for m in self.scenes[0].used_materials()):
            return {"depth": 0}
        before = None
        for depth in DEPTHS:
            image = displayed(self._traced({**UNBIASED, "depth": depth, "samples": 1}, self.seed, work=0).image)
            if before is not None and math.sqrt(np.mean((image - before) ** 2)) < STEP / 4.0:
                depth //= 2
                break
            before = image
        return {**UNBIASED, "depth": depth}

    def _cost_of_a_sample(self):
        """Seconds of one sample of all pixels."""
        self._traced({**self.full, "samples": 1}, self.seed, work=0)  # what is imported or built at first use
        # One alone would cost more than each of many, which are traced together.
        return max(self._traced({**self.full, "samples": 6}, self.seed, work=0).figures["T_R"] / 6.0, 1e-4)

    def _traced(self, options, seed, scene=0, count=False, work=0.0, technique="", seconds=math.inf):
        """A picture; raises Cancelled when stopped, _TooLong after some seconds."""
        end = time.perf_counter() + seconds

        def late():
            return time.perf_counter() > end

        def progress(fraction):
            if late():
                raise Cancelled("It takes too long.")
            if self.progress:
                self.progress(min(1.0, (self.done + fraction * work) / self.total))

        if (scene, technique) not in self.indices:
            try:
                self.indices[scene, technique] = build(self.scenes[scene], technique, progress=progress)
            except Cancelled:
                if late():
                    raise _TooLong from None
                raise
        result = trace(
            self.scenes[scene],
            index=self.indices[scene, technique],
            size=self.size,
            seed=seed,
            count=count,
            progress=progress,
            **options,
        )
        if result.cancelled:
            raise _TooLong if late() else Cancelled("stopped.")
        self.done += work
        return result

    def _settings(self, finest):
        """All settings, and what was left out and why."""
        scene, left_out, settings = self.scenes[0], [], []
        materials = scene.used_materials()

        def curve(knob, name, points, **base):
            settings.extend(Setting(name, label, knob, {**self.full, **base, **options}) for label, options in points)

        doubling = [2**k for k in range(int(math.log2(finest)) + 1)]
        for name, how in (("samples", {}), ("random samples", {"sampling": "random"})):
            curve("antialiasing", name, [(f"{n} samples", {"samples": n, **how}) for n in doubling if n > 1])
        levels = int(math.log(finest, 4) + 1e-9)
        # The variance of fewer than 4 samples says little.
        for way, least in (("corners", 1), ("variance", 2)):
            if levels < least:
                left_out.append(
                    f"adaptive antialiasing, {way}: it needs {4**least} samples a pixel; there is time for fewer. "
                    "Give more --seconds, or a smaller --size."
                )
                continue
            curve(
                "antialiasing",
                f"{way}, {4**levels} samples at most",
                [(f"aa_threshold {t:g}", {"aa_threshold": t}) for t in (0.3, 0.1, 0.03, 0.01)],
                antialiasing=way,
                aa_level=levels - least + 1,
            )
        some = max(finest // 4, 2)
        if any(m.reflects for m in materials):
            curve(
                "depth",
                f"maximum depth, {some} samples",
                [(f"depth {d}", {"depth": d, "threshold": 0.0, "roulette": False}) for d in (0, 1, 2, 4, 6)],
                samples=some,
            )
            for roulette in (False, True):
                curve(
                    "depth",
                    f"adaptive depth{' with roulette' if roulette else ''}, {some} samples",
                    [(f"threshold {t:g}", {"threshold": t, "roulette": roulette}) for t in (0.3, 0.1, 0.03, 0.01)],
                    samples=some,
                )
        else:
            left_out.append("maximum depth, adaptive depth: the scene has no mirrors and no glass.")
        if any(light.has_extent and any(light.colour) for light in scene.lights):
            few = max(finest // 8, 2)
            curve(
                "shadows",
                f"shadow rays to each light, {few} samples",
                [(_shadow_rays(n), {"light_samples": n}) for n in (1, 2, 4, 8) if n * few <= 2 * finest],
                samples=few,
            )
        else:
            left_out.append("shadow rays to each light: no light of the scene has an extent.")
        self._tessellations(settings, left_out, finest)
        self._techniques(settings, left_out, some)
        self._whole_pixels(settings, left_out)
        return settings, left_out

    def _techniques(self, settings, left_out, some):
        """Settings of techniques that trace the same samples: exact ones, and those that find triangles in float32."""
        others = [name for name in TECHNIQUES if name != self.technique]
        for name in FLOAT32:
            try:
                self.indices[0, name] = build(self.scenes[0], name)
                others.append(name)
            except RayscopeError as error:
                left_out.append(f"float32 against float64, {name}: {error}")
        for name in ("", *others):
            label = f"{name or self.technique}{' (float32)' if name in FLOAT32 else ''}"
            options = {**self.full, "samples": some}
            curve = f"techniques, the same {some} samples"
            settings.append(Setting(curve, label, "techniques", options, technique=name, same=True))

    def _whole_pixels(self, settings, left_out):
        """Settings of techniques that trace pixels as a whole, against the samples of all others."""
        scene = self.scenes[0]
        mirrors = any(m.reflects for m in scene.used_materials())
        soft = any(light.has_extent and any(light.colour) for light in scene.lights)
        alone = [("as it is", {})]
        least = [(f"threshold {t:g}", {"threshold": t}) for t in (0.1, 0.03, 0.01)] if mirrors else alone
        rays = [(_shadow_rays(n), {"light_samples": n}) for n in (1, 4, 16)] if soft else alone
        # Rays do not scatter: neither shall cones.
        ways = (("cones", {"gloss": False}, least), ("pyramids", {}, rays), ("beams", {}, rays))
        for name, parameters, points in ways:
            index = build(scene, name, **parameters)
            if not {kind.KIND for kind in index.primitives.kinds} & set(index.SUPPORTED):
                known = ", ".join(index.SUPPORTED)
                left_out.append(f"{name}: the scene has none of the primitives they can be tested against ({known}).")
                continue
            self.indices[0, name] = index
            left_out += [f"{name}: {notice}" for notice in index.notices]
            base = {**self.full, "roulette": False, "samples": 1}
            settings += [
                Setting(f"{name} in place of samples", label, "antialiasing", {**base, **options}, technique=name)
                for label, options in points
            ]

    def _tessellations(self, settings, left_out, finest):
        """Settings with curved solids as meshes."""
        from .tessellate import curved, tessellated

        if not curved(self.scenes[0]):
            left_out.append("tessellation: the scene has no sphere, cylinder or cone by itself.")
            return
        for n in (8, 16, 32, 64):
            self.scenes[n] = tessellated(self.scenes[0], n)
            self.indices[n, ""] = build(self.scenes[n], self.technique)
            settings.append(
                Setting(
                    f"tessellation, {finest} samples",
                    f"{n} segments",
                    "tessellation",
                    {**self.full, "samples": finest},
                    scene=n,
                )
            )

    @staticmethod
    def _work(setting, finest):
        """Cost of a setting, roughly, in samples a pixel."""
        o = setting.options
        if o.get("antialiasing", "uniform") != "uniform":
            return 1.0 + 0.5 * finest
        return o["samples"] * (1.0 + 0.5 * (o.get("light_samples", 1) - 1))

    def _measure(self, settings, work, reference, cost):
        """Trace all settings: once to count, then turn by turn for the times, as often as there is time."""
        # Ways that may take any time come last.
        order = sorted(range(len(settings)), key=lambda i: (bool(settings[i].technique), work[i]))
        spent = {}
        for turn in range(1 + REPEATS):
            for place, i in enumerate(order):
                setting = settings[i]
                left = self.seconds - (time.perf_counter() - self.began)
                # A few points there are in any case. The first timed run belongs to the point, more are made in time.
                if turn == 0:
                    # What was counted is also timed once.
                    skip = left < sum(spent.values()) and place >= FEWEST_POINTS
                else:
                    skip = i not in spent or (turn > 1 and spent[i] > left)
                if skip:
                    self.done += work[i] * (1.5 if turn == 0 else 1.0)
                    continue
                start = time.perf_counter()
                try:
                    result = self._traced(
                        setting.options,
                        self.seed,
                        setting.scene,
                        turn == 0,
                        work[i] * (1.5 if turn == 0 else 1.0),
                        setting.technique,
                        # What is sampled takes about as long as was reckoned; other ways may take any time.
                        max(OVERTIME * cost * work[i], 0.25 * self.seconds, 1.0),
                    )
                except _TooLong:
                    seconds = time.perf_counter() - start
                    setting.why = f"given up after {seconds:.3g} s; give more --seconds, or a smaller --size."
                    continue
                except MemoryEstimateError as error:
                    setting.why = str(error)
                    continue
                spent[i] = time.perf_counter() - start
                if turn == 0:
                    kinds = [f for f in result.figures.values() if isinstance(f, dict)]
                    setting.rays = sum(f["rays"] for f in kinds)
                    setting.tests = round(sum(f["N_IT"] * f["rays"] for f in kinds))
                    if setting.same and self.same is None:
                        self.same = result.image
                    setting.error = errors(result.image, self.same if setting.same else reference)
                else:
                    setting.times.append(result.figures["T_R"])
            self.say(
                f"{'counted' if turn == 0 else f'timed, {turn} of {REPEATS}'}: {time.perf_counter() - self.began:.0f} s"
            )


def _quicker(a, b):
    """Whether setting a takes less time than b for sure; timed only once, it must also have had less to do."""
    often = min(len(a.times), len(b.times)) > 1
    return max(a.times) < min(b.times) and (often or (a.rays < b.rays and a.tests < b.tests))


def _judged(settings, floor):
    """Mark settings that are never worth it, and say in words what came out."""
    words = []
    for s in settings:
        better = [o for o in settings if o.knob == s.knob and o.error["rmse"] <= s.error["rmse"] and _quicker(o, s)]
        if better:
            best = min(better, key=lambda o: o.error["rmse"])
            s.verdict = f"dominated by {best.curve}: {best.label}"
    sampled = [s for s in settings if not s.same]
    if not sampled:
        return ["Nothing was measured: there was no time."]
    enough = [s for s in sampled if s.error["rmse"] <= STEP]
    best = min(sampled, key=lambda s: s.error["rmse"])
    if floor > STEP:
        words.append(
            f"The reference's own error, {floor:.2g}, is above 1/255 = {STEP:.2g}: what reaches 1/255 cannot be told. "
            "Give more --seconds, or a smaller --size."
        )
    elif enough:
        s = min(enough, key=lambda s: min(s.times))
        words.append(
            f"For an error of 1/255 the cheapest setting is {s.curve}: {s.label} (RMSE {s.error['rmse']:.2g}, "
            f"{min(s.times):.3g} s, {s.rays:,} rays)."
        )
    else:
        words.append(f"No setting reached an error of 1/255 = {STEP:.2g}. Give more --seconds, or a smaller --size.")
    words.append(
        f"The least error, {best.error['rmse']:.2g}, has {best.curve}: {best.label} ({min(best.times):.3g} s)"
        + (
            f", which the reference's own error of {floor:.2g} does not let one tell from less."
            if best.error["rmse"] < 2.0 * floor
            else f"; the reference's own error is {floor:.2g}."
        )
    )
    never = {}
    for s in settings:
        if s.verdict:
            never.setdefault(s.curve, []).append(s.label)
    if never:
        words.append(
            "Never worth it, because another setting of the same knob is both faster and no less exact: "
            + "; ".join(f"{curve}: {', '.join(labels)}" for curve, labels in never.items())
            + "."
        )
    return words


def _slopes(settings, floor):
    """Curve -> slope of its error against samples, log-log, where three points stand out from the reference's own."""
    slopes = {}
    for curve in ("samples", "random samples"):
        points = [
            (s.options["samples"], s.error["rmse"])
            for s in settings
            if s.curve == curve and s.error["rmse"] > 2.0 * floor
        ]
        if len(points) >= 3:
            n, rmse = np.array(points).T
            slopes[curve] = float(np.polyfit(np.log(n), 0.5 * np.log(rmse**2 - floor**2), 1)[0])
    return slopes


def _converged(slopes):
    """In words whether random samples do what they must."""
    slope = slopes.get("random samples")
    if slope is None:
        return []
    if abs(slope / SLOPE - 1.0) <= SLACK:
        end = f": {SLOPE:g} within {SLACK:.0%}, as it must be"
    else:
        end = (
            f", which is not {SLOPE:g} within {SLACK:.0%}: there are few settings, or few and rare bright samples, "
            "of which a display shows no more than white"
        )
    stratified = f" Stratified samples: {slopes['samples']:.2f}." if "samples" in slopes else ""
    return [f"With random samples the error falls as samples^{slope:.2f}{end}.{stratified}"]


def _alike(settings):
    """In words what other techniques made of the same samples."""
    same = [s for s in settings if s.same]
    if len(same) < 2:
        return []
    first, others = same[0], same[1:]
    told = []
    for s in others:
        error = s.error["rmse"]
        times = f"{min(s.times) / min(first.times):.2g} x the time of {first.label}"
        told.append(f"{s.label}: {'the same picture' if error == 0 else f'error {error:.2g}'}, {times}")
    return [f"Other techniques, with {first.curve.split(', ')[1]}: {'; '.join(told)}."]


#: Plot -> (figure along x, its title, measure along y).
PLOTS = {
    "error_time.png": ("T", "T: run time, s (least of all runs; the line reaches to the slowest)", "rmse"),
    "error_rays.png": ("rays", "rays", "rmse"),
    "error_tests.png": ("tests", "intersection tests", "rmse"),
    "flip_time.png": ("T", "T: run time, s", "flip"),
}


def plot(path, result, name, title):
    """Draw one of `PLOTS`; returns whether there was anything to draw. Exact settings, error 0, stand at the foot."""
    x, x_title, y = PLOTS[name]
    rows = [r for r in result["rows"] if r[x] > 0]
    if not rows:
        return False
    figure = report.figure_class()(figsize=(10, 6), layout="constrained")
    from matplotlib.ticker import LogLocator

    axes = figure.add_subplot(xlabel=x_title, ylabel=f"{y}: {MEASURES[y]}", title=title, xscale="log", yscale="log")
    # At the foot stands what has no error.
    floor = result["floor"] if y == "rmse" else 0.0
    foot = 0.5 * min((value for value in (floor, *(r[y] for r in rows)) if value > 0), default=1e-6)
    for i, curve in enumerate(dict.fromkeys(r["curve"] for r in rows)):
        points = sorted((r for r in rows if r["curve"] == curve), key=lambda r: r[x])
        xs, ys = [r[x] for r in points], [r[y] or foot for r in points]
        alike = points[0]["against"] != "reference"
        line = "none" if alike else "-" if i < 10 else "--"
        axes.plot(xs, ys, linestyle=line, marker="osD^v<>pPX*h"[i % 12], color=f"C{i % 10}", linewidth=1, label=curve)
        if x == "T":
            axes.hlines(ys, xs, [r["T_worst"] for r in points], color=f"C{i % 10}", alpha=0.4)
        if alike:
            axes.axhline(foot, color=f"C{i % 10}", linewidth=0.5, label="no error")
            places = {}
            for r, py in zip(points, ys):  # those that stand close together share a label
                place = next((p for p in places if p[1] == py and r[x] < 1.1 * p[0]), (r[x], py))
                places.setdefault(place, []).append(r["setting"])
            for place, names in places.items():
                axes.annotate("\n".join(names), place, fontsize=7, xytext=(0, 6), textcoords="offset points")
        elif curve == "random samples" and x == "rays":
            line = [ys[0] * (v / xs[0]) ** SLOPE for v in xs]
            axes.plot(xs, line, color="0.3", linestyle="-.", linewidth=1, label=f"slope {SLOPE:g}")
    if y == "rmse":
        if floor > 0:
            axes.axhline(floor, color="0.5", linestyle="--", label="the reference's own error")
        axes.axhline(STEP, color="0.5", linestyle=":", label="1/255")
    axes.grid(True, which="both", alpha=0.25)
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axis.set_major_formatter(lambda value, place: f"{value:g}")
        axis.set_minor_formatter(lambda value, place: "")
    figure.legend(loc="outside right upper", frameon=False, fontsize=8)
    figure.savefig(path, dpi=110)
    return True


def write(result, folder, title):
    """Write error.csv, the plots and error.html, which holds them all.

    Parameters
    ----------
    result : dict
        From :func:`error_time`.
    folder : path-like
    title : str

    Returns
    -------
    files : list of Path
    note : str
        How to get plots, where matplotlib is missing; else empty.
    """
    folder, note = report.folder(folder), ""
    files = [folder / "error.csv"]
    files[0].write_text(report.to_csv(result["rows"], COLUMNS), encoding="utf-8")
    drawn = []
    try:
        drawn = [folder / name for name in PLOTS if plot(folder / name, result, name, title)]
    except MissingPackageError as error:
        note = str(error)
    page = folder / "error.html"
    page.write_text(_page(result, title, drawn, note), encoding="utf-8")
    return [*files, *drawn, page], note


def _page(result, title, pictures, note):
    """One HTML page with everything in it."""

    def cell(row, column):
        value = row.get(column)
        kind = "" if isinstance(value, str) else " class=n"
        return f"<td{kind}>{html.escape(report.text(value, column))}</td>"

    head = "".join(f"<th title='{html.escape(ABOUT.get(c, c))}'>{c}</th>" for c in COLUMNS)
    body = "".join(f"<tr>{''.join(cell(r, c) for c in COLUMNS)}</tr>" for r in result["rows"])
    images = "".join(
        f"<img alt='{p.stem}' src='data:image/png;base64,{base64.b64encode(p.read_bytes()).decode()}'>"
        for p in pictures
    )
    lines = "".join(f"<p>{html.escape(line)}</p>" for line in [*result["words"], *([note] if note else [])])
    left = "".join(f"<li>{html.escape(line)}</li>" for line in result["left_out"])
    return f"""<!doctype html><html lang=en><meta charset=utf-8><meta name=viewport content="width=device-width">
<title>{html.escape(title)}</title>
<style>body{{font:16px/1.5 system-ui,sans-serif;max-width:1100px;margin:2em auto;padding:0 1em}}img{{max-width:100%}}
table{{border-collapse:collapse;font-size:13px;display:block;overflow-x:auto}}
td,th{{padding:.2em .6em;text-align:left;border-bottom:1px solid #ddd}}
td.n{{text-align:right}}</style>
<h1>Error against run time</h1><p>{html.escape(title)}</p>{lines}{images}
<table><tr>{head}</tr>{body}</table><h2>Left out</h2><ul>{left}</ul></html>
"""
