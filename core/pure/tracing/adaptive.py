"""Adaptive antialiasing in this core; see :mod:`~rayscope.core.adaptive`."""

import math

from ...adaptive import AROUND, DEPTHS, FAR, FEW, FIRST, RISE, SPENT, Adaptive, ByVariance
from ...vectors import add, mul, times
from . import sampling
from .camera import through


def shown(radiance):
    """Displayed value of a linear one."""
    return math.sqrt(min(max(radiance, 0.0), 1.0))


class Counted(Adaptive):
    """Adds up what was spent on pixels."""

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self._forget()

    def _forget(self):
        """Nothing is spent since."""
        self.pixels, self.costs = [], {}

    def _spend(self, x, y, values):
        """Take what was spent on a pixel out of what the tracer returned."""
        self.pixels.append(y * self.tracer.size[0] + x)
        for name in SPENT:
            if name in values:
                self.costs.setdefault(name, []).append(values.pop(name))
        return values

    def _spent(self):
        """What was spent since this was asked for."""
        spent = self.pixels, self.costs
        self._forget()
        return spent


class Corners(Counted):
    """Whitted's (1980): a pixel's corners are traced; where they differ it is divided into four squares, and so on.

    A square's colour is the mean of its corners'. Pixels are divided when their corners differ in displayed colour, in
    the object seen or in depth; the squares inside, when they differ in colour. Neighbours share their corners.
    """

    def __init__(self, tracer, region, threshold, level, samples):
        super().__init__(tracer, region, threshold, level, samples)
        #: Points lie on a lattice with 2**level steps a pixel.
        self.side = 1 << level
        #: Point -> (radiance, object, depth).
        self.known = {}

    def parts(self, order):
        """See :class:`Adaptive`."""
        for i, tile in enumerate(order):
            yield (i + 1) / (2 * len(order)), tile, self._first(*tile), self._spent()
        for i, (x0, y0, x1, y1) in enumerate(order):
            corners = [(x * self.side, y * self.side) for y in range(y0, y1) for x in range(x0, x1)]
            pixels = [self._square(*corner, self.side) for corner in corners]
            yield 0.5 + (i + 1) / (2 * len(order)), order[i], {"combined": pixels}, self._spent()

    def _first(self, x0, y0, x1, y1):
        """The lower left corners of a tile's pixels."""
        out = {}
        for y in range(y0, y1):
            for x in range(x0, x1):
                for name, value in self._traced(x * self.side, y * self.side).items():
                    out.setdefault(name, []).append(value)
        return out

    def _traced(self, ix, iy):
        """Trace a point of the lattice; all that the tracer returns."""
        tracer = self.tracer
        o, d = through(tracer.scene.camera, tracer.size, ix / self.side, iy / self.side)
        key = sampling.first_key(iy * (tracer.size[0] * self.side + 1) + ix, 0, tracer.seed)
        values = tracer.traced(o, d, key, True)
        self._spend(min(ix // self.side, self.region[2] - 1), min(iy // self.side, self.region[3] - 1), values)
        self.known[ix, iy] = values["combined"], values["object_index"], values["depth"]
        return values

    def _square(self, ix, iy, step):
        """Radiance of a square of the lattice."""
        corners = []
        for point in ((ix, iy), (ix + step, iy), (ix, iy + step), (ix + step, iy + step)):
            if point not in self.known:
                self._traced(*point)
            corners.append(self.known[point])
        total = (0.0, 0.0, 0.0)
        if step > 1 and self._differ(corners, step == self.side):
            step //= 2
            for x, y in ((ix, iy), (ix + step, iy), (ix, iy + step), (ix + step, iy + step)):
                total = add(total, self._square(x, y, step))
        else:
            for radiance, *_ in corners:
                total = add(total, radiance)
        return times(0.25, total)

    def _differ(self, corners, whole_pixel):
        """Whether the corners of a square differ."""
        colours, things, depths = zip(*corners)
        for channel in zip(*colours):
            values = [shown(v) for v in channel]
            if max(values) - min(values) > self.threshold:
                return True
        return whole_pixel and (len(set(things)) > 1 or max(depths) > DEPTHS * min(depths))


class Variance(Counted, ByVariance):
    """More samples where they take most from the error."""

    def parts(self, order):
        """See :class:`Adaptive`."""
        x0, y0, x1, y1 = self.region
        everywhere = [(x, y) for y in range(y0, y1) for x in range(x0, x1)]
        #: Pixel -> number of samples, their sum, the sum of their squares.
        self.state = {pixel: (0, (0.0,) * 3, (0.0,) * 3) for pixel in everywhere}
        self.rays = dict.fromkeys(everywhere, 0)
        more, left = dict.fromkeys(everywhere, self.begin), 1.0
        for turn in range(1 + self.rounds):
            if turn:
                for pixel, times_more in self._worth(everywhere).items():
                    n = self.state[pixel][0]
                    more[pixel] = min(n * times_more, self.most - n)
                if sum(more.values()) * FEW < len(more):
                    break
            # Each turn has about half as many rays as the one before.
            left *= 0.5
            for i, tile in enumerate(order):
                out, combined, worked = {}, [], False
                for y in range(tile[1], tile[3]):
                    for x in range(tile[0], tile[2]):
                        for _ in range(more[x, y]):
                            worked = True
                            for name, value in self._sampled(x, y).items():
                                out.setdefault(name, []).append(value)
                        n, total, _ = self.state[x, y]
                        combined.append(times(1.0 / n, total))
                if worked:
                    fraction = 1.0 - left * (2.0 - (i + 1) / len(order))
                    yield fraction, tile, {**out, "combined": combined}, self._spent()

    def _sampled(self, x, y):
        """Take a pixel's next sample; the passes that the first one gives."""
        n, total, squares = self.state[x, y]
        values = self.tracer.pixel(x, y, n)
        self.rays[x, y] += values["rays_per_pixel"]
        self._spend(x, y, values)
        radiance = values.pop("combined")
        self.state[x, y] = n + 1, add(total, radiance), add(squares, mul(radiance, radiance))
        return values

    def _variance(self, pixel):
        """Of a pixel's samples."""
        n, total, squares = self.state[pixel]
        return tuple(max(s / n - (t / n) * (t / n), 0.0) * (n / (n - 1)) for s, t in zip(squares, total))

    def _worth(self, pixels):
        """How many times the samples that they have the pixels shall get."""
        variances = {pixel: self._variance(pixel) for pixel in pixels}
        off = {pixel: self._off(pixel, variances) for pixel in pixels}
        if self.noise is None:
            self.noise = math.sqrt(sum(v * v for v in off.values()) / len(off))
        costs = {pixel: self.rays[pixel] / self.state[pixel][0] for pixel in pixels}
        usual, worth = sum(costs.values()) / len(costs), {}
        for pixel in pixels:
            n = self.state[pixel][0]
            allowed = self.allowed() * (n / FIRST) ** RISE * math.sqrt(costs[pixel] / usual)
            worth[pixel] = 3 if off[pixel] > FAR * allowed else 1 if off[pixel] > allowed else 0
        return worth

    def _off(self, pixel, variances):
        """Standard error of a pixel, as displayed."""
        x, y = pixel
        near = [variances[p] for dy in (-1, 0, 1) for dx in (-1, 0, 1) if (p := (x + dx, y + dy)) in variances]
        n, total, _ = self.state[pixel]
        off = 0.0
        for channel in range(3):
            mean, around = total[channel] / n, sum(v[channel] for v in near) / len(near)
            error = math.sqrt((n * variances[pixel][channel] + AROUND * around) / ((n + AROUND) * n))
            # Either way: a pixel that is all white so far can only become darker.
            off = max(off, shown(mean + error) - shown(mean), shown(mean) - shown(mean - error))
        return off


WAYS = {"corners": Corners, "variance": Variance}
