"""Numbers of rays that any correct ray tracer must find on the Standard Procedural Databases, whatever its method.

Published by V. Havran and F. Sixta, Comparison of Hierarchical Grids, Ray Tracing News 12(1), 1999: 513 x 513 rays
through the corners of pixels; every hit sends a shadow ray to each light on the side of its geometric normal, a
reflected ray where Ks > 0 or T > 0, and a refracted one where T > 0, down to four bounces. They traced the databases as
printed, with six digits. The paper does not say all of its rules: these were found by trying, as the ones that come
nearest to its numbers.

One of them is a guess at how his program worked. A shadow ray that leaves a polygon on the side that the viewer's ray
did not come from (from within a glass gear, to a light outside) counts as blocked, as if it began a little before the
polygon; of spheres it does not. Without it a fifth of the blocked shadow rays is missing among the gears; with it all
numbers of all scenes are within 9 %.
"""

import numpy as np
import pytest

from rayscope.core import Scene, build
from rayscope.core.scene.spd import spd

#: Primary rays that hit; shadow rays; those of them that hit; reflected and refracted rays.
PUBLISHED = {
    "balls": (263169, 959244, 285178, 179884), "gears": (245332, 2088012, 1057557, 494338), "lattice": (261170, 1180774, 943159, 243210),
    "mount": (173685, 361037, 74555, 710436), "rings": (263169, 1077336, 510719, 312879), "teapot": (161546, 406340, 34757, 226235),
    "tetra": (49950, 46262, 5538, 0), "tree": (169907, 1110323, 47506, 0),
}
BOUNCES = 4
#: Rays start this far from their surfaces.
START = 1e-6


def as_printed(scene, path):
    """The scene with its numbers as a file of the Neutral File Format has them; the camera stays as it is."""
    def row(*values):
        return " ".join(f"{v:g}" for v in np.hstack(values))
    obj, = scene.objects
    lines = ["l " + row(light.position) for light in scene.lights]
    slot = None
    for s in obj.geometry.solids:
        if s.slot != slot:
            slot, m = s.slot, obj.materials[s.slot]
            lines.append("f " + row(m.base, m.diffuse, m.specular, m.shininess, m.transmission, m.ior))
        origin, axis, radius = s.matrix[:3, 3], s.matrix[:3, 2], np.linalg.norm(s.matrix[:3, 0])
        if s.kind == "sphere":
            lines.append("s " + row(origin, radius))
        elif s.kind in ("cylinder", "cone"):
            lines.append("c " + row(origin, radius, origin + axis, radius * s.values.get("ratio", 1.0)))
        else:
            # Smooth normals play no part in these numbers.
            lines += [f"p {len(s.values['points'])}", *(row(p) for p in s.values["points"])]
    path.write_text("\n".join(lines))
    printed = Scene.from_nff(path)
    assert printed.n_primitives == scene.n_primitives and [n.text for n in printed.notices] == ["the view (v) lacks from, at, up, angle; there is no camera."]
    printed.camera = scene.camera
    return printed


def numbers_of_rays(scene):
    """Trace by the rules above."""
    index = build(scene, "bvh")
    obj, = scene.objects
    slot = np.array([s.slot for s in obj.geometry.solids])
    flat = np.array([s.kind in ("polygon", "triangle") for s in obj.geometry.solids])
    reflects, refracts, ior = (np.array([getattr(m, name) for m in obj.materials]) for name in ("mirror", "transmission", "ior"))
    y, x = np.mgrid[0:513, 0:513]
    o, d = scene.camera.rays(x.ravel(), y.ravel(), (512, 512))
    primary = shadow = blocked = onward = 0
    for bounce in range(BOUNCES + 1):
        hits = index.closest(o, d, t_min=START if bounce else 0.0)
        met = hits.hit
        if not bounce:
            primary = np.count_nonzero(met)
        p, normal, d, material = hits.point[met], hits.normal[met], d[met], slot[hits.primitive[met]]
        behind = flat[hits.primitive[met]] & ((normal * d).sum(axis=1) > 0.0)
        for light in scene.lights:
            to = np.array(light.position) - p
            distance = np.linalg.norm(to, axis=1)
            to /= distance[:, None]
            facing = (normal * to).sum(axis=1) > 0.0
            shadow += np.count_nonzero(facing)
            blocked += np.count_nonzero(behind[facing] | index.occluded(p[facing], to[facing], t_min=START, t_max=distance[facing]))
        if bounce == BOUNCES:
            break
        d = d / np.linalg.norm(d, axis=1, keepdims=True)
        cosine = -(normal * d).sum(axis=1)
        side = np.where(cosine < 0.0, -1.0, 1.0)
        normal, cosine = normal * side[:, None], np.abs(cosine)
        mirrored = np.flatnonzero((reflects[material] > 0.0) | (refracts[material] > 0.0))
        # Snell's law; beyond the critical angle there is no refracted ray.
        eta = np.where(side > 0.0, 1.0 / np.maximum(ior[material], 1e-9), ior[material])
        k = 1.0 - eta**2 * (1.0 - cosine**2)
        refracted = np.flatnonzero((refracts[material] > 0.0) & (k >= 0.0))
        reflected = d + 2.0 * cosine[:, None] * normal
        bent = eta[:, None] * d + (eta * cosine - np.sqrt(np.maximum(k, 0.0)))[:, None] * normal
        o = np.concatenate([p[mirrored], p[refracted]])
        d = np.concatenate([reflected[mirrored], bent[refracted]])
        onward += len(o)
        if not len(o):
            break
    return primary, shadow, blocked, onward


@pytest.mark.parametrize("name", PUBLISHED)
def test_rays_as_published(name, tmp_path):
    found = numbers_of_rays(as_printed(spd(name), tmp_path / f"{name}.nff"))
    assert abs(found[0] - PUBLISHED[name][0]) <= 2
    for own, published in zip(found[1:], PUBLISHED[name][1:]):
        assert own == pytest.approx(published, rel=0.1)
