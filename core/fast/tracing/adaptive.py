"""Adaptive antialiasing in this core; see :mod:`~rayscope.core.adaptive`."""

import math

import numpy as np

from ...adaptive import AROUND, DEPTHS, FAR, FEW, FIRST, RISE, SPENT, Adaptive, ByVariance
from . import sampling
from .whitted import WAVE


def shown(radiance):
    """Displayed values of linear ones."""
    return np.sqrt(np.clip(radiance, 0.0, 1.0))


def taken(values):
    """Take what was spent out of what the tracer returned."""
    return {name: values.pop(name) for name in SPENT if name in values}


class Corners(Adaptive):
    """Whitted's (1980): a pixel's corners are traced; where they differ it is divided into four squares, and so on.

    A square's colour is the mean of its corners'. Pixels are divided when their corners differ in displayed colour, in
    the object seen or in depth; the squares inside, when they differ in colour. Neighbours share their corners.
    """

    def __init__(self, tracer, region, threshold, level, samples):
        super().__init__(tracer, region, threshold, level, samples)
        x0, y0, x1, y1 = region
        #: Points are numbered on a lattice with 2**level steps a pixel.
        self.side = 1 << level
        self.row = tracer.size[0] * self.side + 1
        #: Of the pixels' corners: red, green, blue, object, depth.
        self.corners = np.empty((y1 - y0 + 1, x1 - x0 + 1, 5))
        #: Points between the corners, by ascending number: those at the tiles' edges, which neighbours use too.
        self.known, self.values = np.empty(0, np.int64), np.empty((0, 5))

    def parts(self, order):
        """See :class:`Adaptive`."""
        for i, tile in enumerate(order):
            yield (i + 1) / (2 * len(order)), tile, *self._first(*tile)
        for i, tile in enumerate(order):
            yield 0.5 + (i + 1) / (2 * len(order)), tile, *self._refined(*tile)

    def _traced(self, ix, iy):
        """Values of points of the lattice, all that the tracer returns of them, and what they cost which pixels."""
        x0, y0, x1, y1 = self.region
        tracer = self.tracer
        origins, directions = tracer.scene.camera.rays(ix / self.side, iy / self.side, tracer.size)
        key = sampling.first_key(iy * self.row + ix, 0, tracer.seed)
        out = tracer.traced(np.ascontiguousarray(origins.T), np.ascontiguousarray(directions.T), key, True)
        values = np.column_stack([out["combined"], out["object_index"], out["depth"]])
        pixels = np.minimum(iy // self.side, y1 - 1) * tracer.size[0] + np.minimum(ix // self.side, x1 - 1)
        return values, out, (pixels, taken(out))

    def _first(self, x0, y0, x1, y1):
        """The lower left corners of a tile's pixels, and the others at the region's upper and right edge."""
        left, bottom, right, top = self.region
        x2, y2 = x1 + (x1 == right), y1 + (y1 == top)
        iy, ix = (a.ravel() * self.side for a in np.mgrid[y0:y2, x0:x2])
        values, out, spent = self._traced(ix, iy)
        self.corners[y0 - bottom : y2 - bottom, x0 - left : x2 - left] = values.reshape(y2 - y0, x2 - x0, 5)
        inside = np.flatnonzero((ix < x1 * self.side) & (iy < y1 * self.side))
        return {name: value[inside] for name, value in out.items()}, spent

    def _refined(self, x0, y0, x1, y1):
        """Divide the pixels of a tile."""
        left, bottom = self.region[:2]
        iy, ix = (a.ravel() * self.side for a in np.mgrid[y0:y1, x0:x1])
        n, step = len(ix), self.side
        pixel, total, spent = np.arange(n), np.zeros((n, 3)), []
        while len(pixel):
            corner_x = np.stack([ix, ix + step, ix, ix + step])
            corner_y = np.stack([iy, iy, iy + step, iy + step])
            if step == self.side:
                values = self.corners[corner_y // step - bottom, corner_x // step - left]
            else:
                values = self._at(corner_x, corner_y, spent)
            # Squares that stay as they are, and those that are divided.
            divided = self._differ(values, step == self.side) if step > 1 else np.zeros(len(pixel), bool)
            whole = np.flatnonzero(~divided)
            share = values[:, whole, :3].sum(axis=0) * (0.25 * (step / self.side) ** 2)
            for c in range(3):
                total[:, c] += np.bincount(pixel[whole], share[:, c], minlength=n)
            some, step = np.flatnonzero(divided), step // 2
            ix = np.concatenate([ix[some] + dx for dx in (0, step, 0, step)])
            iy = np.concatenate([iy[some] + dy for dy in (0, 0, step, step)])
            pixel = np.tile(pixel[some], 4)
        border_y, border_x = np.divmod(self.known, self.row)
        inside_x = (border_x > x0 * self.side) & (border_x < x1 * self.side)
        edge = np.flatnonzero(~(inside_x & (border_y > y0 * self.side) & (border_y < y1 * self.side)))
        self.known, self.values = self.known[edge], self.values[edge]
        return {"combined": total}, _joined(spent)

    def _at(self, ix, iy, spent):
        """Values of points, those not known traced; what that cost is added to the list `spent`."""
        x0, y0, *_ = self.region
        number = iy * self.row + ix
        values = np.empty((*number.shape, 5))
        corner = (ix % self.side == 0) & (iy % self.side == 0)
        values[corner] = self.corners[iy[corner] // self.side - y0, ix[corner] // self.side - x0]
        between = ~corner
        asked = np.unique(number[between])
        new = asked[~np.isin(asked, self.known, assume_unique=True)]
        parts = [self._traced(part % self.row, part // self.row)[::2] for part in _chunks(new)]
        if parts:
            order = np.argsort(np.concatenate([self.known, new]), kind="stable")
            self.values = np.concatenate([self.values, *(p[0] for p in parts)])[order]
            self.known = np.concatenate([self.known, new])[order]
            spent += [p[1] for p in parts]
        values[between] = self.values[np.searchsorted(self.known, number[between])]
        return values

    def _differ(self, values, whole_pixels):
        """Which squares have corners that differ."""
        colour = shown(values[..., :3])
        differ = ((colour.max(axis=0) - colour.min(axis=0)) > self.threshold).any(axis=-1)
        if whole_pixels:
            thing, depth = values[..., 3], values[..., 4]
            differ |= (thing != thing[0]).any(axis=0) | (depth.max(axis=0) > DEPTHS * depth.min(axis=0))
        return differ


class Variance(ByVariance):
    """More samples where they take most from the error."""

    def parts(self, order):
        """See :class:`Adaptive`."""
        x0, y0, x1, y1 = self.region
        shape = (y1 - y0, x1 - x0)
        n = np.zeros(shape, np.int64)
        total, squares, rays = np.zeros((*shape, 3)), np.zeros((*shape, 3)), np.zeros(shape)
        more, left = np.full(shape, self.begin), 1.0
        for turn in range(1 + self.rounds):
            if turn:
                more = np.minimum(n * self._worth(n, total, squares, rays), self.most - n)
                if more.sum() * FEW < more.size:
                    break
            # Each turn has about half as many rays as the one before.
            left *= 0.5
            for i, tile in enumerate(order):
                part = np.s_[tile[1] - y0 : tile[3] - y0, tile[0] - x0 : tile[2] - x0]
                if not more[part].any():
                    continue
                first, spent = {}, []
                for py, px, number in self._samples(n[part], more[part]):
                    pixels = (tile[1] + py) * self.tracer.size[0] + tile[0] + px
                    out = self.tracer.sampled(pixels, number)
                    costs, radiance = taken(out), out.pop("combined")
                    spent.append((pixels, costs))
                    np.add.at(rays[part], (py, px), costs["rays_per_pixel"])
                    np.add.at(total[part], (py, px), radiance)
                    with np.errstate(over="ignore"):
                        np.add.at(squares[part], (py, px), radiance * radiance)
                    begun = np.flatnonzero(number == 0)
                    for name, value in out.items():
                        first.setdefault(name, []).append(value[begun])
                n[part] += more[part]
                first = {name: np.concatenate(values) for name, values in first.items()}
                first["combined"] = (total[part] / n[part][..., None]).reshape(-1, 3)
                yield 1.0 - left * (2.0 - (i + 1) / len(order)), tile, first, _joined(spent)

    @staticmethod
    def _samples(n, more):
        """Pixels of a tile and numbers of their samples, in chunks."""
        py, px = np.nonzero(more)
        times = more[py, px]
        within = np.arange(times.sum()) - np.repeat(np.cumsum(times) - times, times)
        which = np.repeat(np.arange(len(py)), times)
        for part in _chunks(np.arange(len(which))):
            w = which[part]
            yield py[w], px[w], n[py[w], px[w]] + within[part]

    def _worth(self, n, total, squares, rays):
        """How many times the samples that they have the pixels shall get."""
        many = n[..., None]
        with np.errstate(over="ignore", invalid="ignore"):
            mean = total / many
            variance = np.maximum(squares / many - mean * mean, 0.0) * (many / (many - 1))
            error = np.sqrt((many * variance + AROUND * _mean_of_9(variance)) / ((many + AROUND) * many))
            # Either way: a pixel that is all white so far can only become darker.
            off = np.maximum(shown(mean + error) - shown(mean), shown(mean) - shown(mean - error)).max(axis=-1)
        off = np.nan_to_num(off)  # of infinite radiance nothing can be told
        if self.noise is None:
            self.noise = math.sqrt(np.mean(off * off))
        cost = rays / n
        allowed = self.allowed() * (n / FIRST) ** RISE * np.sqrt(cost / cost.mean())
        return np.where(off > FAR * allowed, 3, np.where(off > allowed, 1, 0))


def _mean_of_9(a):
    """Mean of the 3 x 3 entries around each, of those that there are."""
    padded = np.pad(np.concatenate([a, np.ones((*a.shape[:2], 1))], axis=-1), ((1, 1), (1, 1), (0, 0)))
    height, width = a.shape[:2]
    sums = sum(padded[y : y + height, x : x + width] for y in range(3) for x in range(3))
    return sums[..., :-1] / sums[..., -1:]


def _joined(spent):
    """One (pixels, costs) from a list of them."""
    pixels = np.concatenate([np.empty(0, np.int64), *(p for p, _ in spent)])
    return pixels, {name: np.concatenate([c[name] for _, c in spent]) for name in (spent[0][1] if spent else ())}


def _chunks(a):
    """Pieces of an array, as long as the tracer's waves."""
    return [a[i : i + WAVE] for i in range(0, len(a), WAVE)]


WAYS = {"corners": Corners, "variance": Variance}
