"""Published measurements of grids and octrees on the Standard Procedural Databases, and the rays to repeat them with.

V. Havran and F. Sixta, Comparison of Hierarchical Grids, and V. Havran, A Summary of Octree Ray Traversal Algorithms,
Ray Tracing News 12(1) and 12(2), 1999. Rays: 513 x 513 through the corners of pixels, their shadow rays, reflections
and refractions, as in test_spd_invariants. No mailboxes. N_IT and N_TS are means over all rays;
but N_IT of octrees is per ray that hits: so calculated, ours are his (``rays_over_hits``).

    python -m pytest tests/literature        checks all of it
    python tests/literature/table.py         prints the tables of the README
"""

import numpy as np
from rayscope.core import build

SCENES = ("balls", "gears", "lattice", "mount", "rings", "teapot", "tetra", "tree")

#: Uniform grid, density 1 and 10: resolution, N_EV, N_OIV, N_IT, N_TS. N_V is the product of the resolution.
GRID = {
    1: {
        "balls": ((46, 46, 3), 4208, 10240, 358.66, 5.69),
        "gears": ((32, 33, 9), 6080, 39344, 39.76, 6.84),
        "lattice": ((20, 20, 20), 0, 32152, 20.67, 5.09),
        "mount": ((20, 20, 20), 6502, 21746, 19.01, 8.85),
        "rings": ((21, 20, 21), 6264, 27666, 45.29, 11.78),
        "teapot": ((28, 29, 11), 7226, 22982, 33.65, 14.98),
        "tetra": ((16, 16, 16), 3104, 12556, 20.64, 7.43),
        "tree": ((52, 52, 3), 5400, 11102, 727.62, 7.60),
    },
    10: {
        "balls": ((103, 103, 7), 63393, 19966, 72.54, 12.40),
        "gears": ((71, 71, 18), 66531, 110029, 22.82, 13.83),
        "lattice": ((44, 44, 44), 38016, 90368, 9.26, 10.56),
        "mount": ((44, 44, 42), 71924, 51144, 13.17, 18.43),
        "rings": ((44, 43, 44), 66753, 71303, 23.36, 24.51),
        "teapot": ((61, 61, 25), 83721, 52781, 15.13, 32.50),
        "tetra": ((35, 35, 35), 37311, 35936, 10.01, 15.97),
        "tree": ((117, 118, 5), 55191, 22407, 246.08, 15.45),
    },
}

#: Octrees of four levels: N_IN, N_EV, N_OIV, then N_IT and N_TS of O84 (point location) and of O93 (depth first).
OCTREE = {
    "centre": {
        "balls": (57, 300, 9171, 1787.0, 48.53, 1794.0, 20.58),
        "gears": (265, 652, 39440, 157.5, 27.46, 150.1, 12.86),
        "lattice": (585, 0, 22112, 28.6, 22.03, 26.94, 10.13),
        "mount": (232, 777, 18107, 42.53, 22.43, 41.97, 10.80),
        "rings": (231, 416, 22505, 107.8, 32.34, 108.0, 14.66),
        "teapot": (227, 777, 18845, 184.0, 33.66, 182.7, 14.79),
        "tetra": (305, 1072, 13312, 120.0, 21.54, 117.2, 9.59),
        "tree": (53, 278, 9029, 8066.0, 63.48, 8057.0, 26.62),
    },
    "cost": {
        "balls": (131, 214, 10160, 81.2, 27.73, 84.31, 12.95),
        "gears": (349, 580, 31144, 68.78, 23.5, 65.44, 11.70),
        "lattice": (585, 0, 18768, 24.0, 22.33, 23.05, 10.27),
        "mount": (312, 866, 21489, 31.38, 22.61, 30.89, 10.71),
        "rings": (347, 406, 20867, 58.0, 30.24, 57.85, 13.98),
        "teapot": (330, 853, 25332, 106.3, 35.82, 103.2, 15.42),
        "tetra": (325, 1116, 13792, 99.56, 21.15, 97.06, 9.59),
        "tree": (71, 231, 9489, 236.4, 31.83, 235.2, 14.83),
    },
}

BOUNCES = 4
#: Rays start this far from their surfaces.
START = 1e-6


def rays_of(scene, step=4):
    """All rays of a picture, of which every `step`-th pixel in both directions is traced.

    Returns
    -------
    list of (origins, directions, t_min, t_max, any)
        `any` says that any hit will do.
    """
    index = build(scene, "bvh")
    (obj,) = scene.objects
    slot = np.array([s.slot for s in obj.geometry.solids])
    mirror, glass, ior = (
        np.array([getattr(m, name) for m in obj.materials]) for name in ("mirror", "transmission", "ior")
    )
    y, x = np.mgrid[0:513:step, 0:513:step]
    o, d = scene.camera.rays(x.ravel(), y.ravel(), (512, 512))
    rays = []
    for bounce in range(BOUNCES + 1):
        t_min = START if bounce else 0.0
        rays.append((o, d, t_min, np.inf, False))
        hits = index.closest(o, d, t_min=t_min)
        met = hits.hit
        p, normal, d, material = hits.point[met], hits.normal[met], d[met], slot[hits.primitive[met]]
        for light in scene.lights:
            to = np.array(light.position) - p
            distance = np.linalg.norm(to, axis=1)
            some = (to * normal).sum(axis=1) > 0.0
            rays.append((p[some], to[some] / distance[some, None], START, distance[some], True))
        d = d / np.linalg.norm(d, axis=1, keepdims=True)
        along = (d * normal).sum(axis=1)
        facing, cosine = np.where((along > 0.0)[:, None], -normal, normal), -np.abs(along)
        reflected = d - 2.0 * cosine[:, None] * facing
        through = glass[material] > 0.0
        eta = np.where(along > 0.0, ior[material], 1.0 / np.maximum(ior[material], 1e-9))
        k = 1.0 - eta**2 * (1.0 - cosine**2)
        refracted = eta[:, None] * d - (eta * cosine + np.sqrt(np.maximum(k, 0.0)))[:, None] * facing
        reflects, refracts = (mirror[material] > 0.0) | through, through & (k > 0.0)
        o, d = np.concatenate([p[reflects], p[refracts]]), np.concatenate([reflected[reflects], refracted[refracts]])
        if not len(o):
            break
    return rays


def by_boxes(self, item, lo, hi):
    """His rule for lists: spheres exactly, everything else by its bounding box."""
    inside = ((self.lo[item] <= hi) & (self.hi[item] >= lo)).all(axis=1)
    for kind, at, own in self._by_kind(item):
        if kind.KIND == "sphere":
            inside[at] = kind.overlaps(own, lo[at], hi[at])
    return inside


def thick(self):
    """His boxes of polygons of more than three corners, in place of ``Polygons.bounds``:
    as if they were THICK to either side, along every axis that their normals have more
    than SLOPE of. Found by trying, with gears, whose teeth are smaller than that.
    """
    normal = np.abs(self.corners.normal.T)
    grown = THICK * (normal > SLOPE * np.linalg.norm(normal, axis=1, keepdims=True))
    return self.lo - grown, self.hi + grown


#: In units of the scenes: empty cells are had to the last one.
THICK, SLOPE = 0.02, 0.3


def by_open_boxes(self, item, lo, hi):
    """As `by_boxes`, cells being open below: what touches a cell's lower faces only is not in it.
    It matters to tetra alone, whose vertices lie on planes between cells.
    """
    inside = by_boxes(self, item, lo, hi)
    return inside & (self.hi[item] > lo + TOUCHES * (self.hi.max() - self.lo.min())).all(axis=1)


#: More than cells overlap, and less than any primitive reaches into a cell, as a part of the scene's extent.
TOUCHES = 1e-6


def rays_over_hits(scene, rays):
    """The number of rays over that of rays that hit."""
    index = build(scene, "bvh")
    hits = 0
    for o, d, t_min, t_max, any_hit in rays:
        if len(o):
            found = index.occluded(o, d, t_min=t_min, t_max=t_max) if any_hit else index.closest(o, d, t_min=t_min, t_max=t_max).hit
            hits += np.count_nonzero(found)
    return sum(len(r[0]) for r in rays) / hits


def per_ray(index, rays):
    """Mean N_IT and N_TS over all rays."""
    tests = steps = n = 0
    for o, d, t_min, t_max, any_hit in rays:
        if not len(o):
            continue
        if any_hit:
            counts = index.occluded(o, d, t_min=t_min, t_max=t_max, count=True)[1]
            n_it, n_ts = counts["n_it"], counts["n_ts"]
        else:
            hits = index.closest(o, d, t_min=t_min, t_max=t_max, count=True)
            n_it, n_ts = hits.n_it, hits.n_ts
        tests, steps, n = tests + n_it.sum(), steps + n_ts.sum(), n + len(o)
    return tests / n, steps / n
