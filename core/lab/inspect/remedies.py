"""Remedies, applied to a copy of a scene: each function returns one, which takes a scene and returns another."""

from dataclasses import replace

import numpy as np

from ...catalogue import build
from ...scene.layout import to_world
from ...scene.scene import Mesh, Object, Scene


def without(*numbers):
    """A remedy: these objects are not there."""
    return lambda scene: replace(scene, objects=[o for k, o in enumerate(scene.objects) if k not in numbers],
                                 notices=[])


def with_mesh(number, corners):
    """A remedy: an object's mesh consists of these triangles, in world space."""
    def apply(scene):
        objects, own = list(scene.objects), scene.objects[number]
        mesh = Mesh(corners.reshape(-1, 3), np.arange(3 * len(corners)).reshape(-1, 3))
        objects[number] = Object(own.name, mesh, np.eye(4), own.materials[:1] or own.materials)
        return replace(scene, objects=objects, notices=[])
    return apply


def linked(numbers):
    """A remedy: objects of the same shape share the first one's mesh, turned, mirrored and scaled to where they are."""
    def apply(scene):
        objects, mesh = list(scene.objects), scene.objects[numbers[0]].geometry
        own = np.asarray(mesh.vertices, float)
        middle = own.mean(axis=0)
        for k in numbers[1:]:
            o = objects[k]
            world = to_world(o.matrix, o.geometry.vertices)
            # Procrustes: the turn that takes one cloud of points onto the other (Schoenemann 1966).
            u, stretch, v = np.linalg.svd((world - world.mean(axis=0)).T @ (own - middle))
            matrix = np.eye(4)
            matrix[:3, :3] = stretch.sum() / (((own - middle) ** 2).sum() or 1.0) * (u @ v)
            matrix[:3, 3] = world.mean(axis=0) - matrix[:3, :3] @ middle
            if np.abs(to_world(matrix, own) - world).max() <= 1e-3 * np.ptp(world, axis=0).max():
                objects[k] = replace(o, geometry=mesh, matrix=matrix)
        return replace(scene, objects=objects, notices=[])
    return apply


def united(pairs, corners):
    """A remedy: of objects that overlap in pairs the triangles are left out whose middle lies inside another."""
    def apply(scene):
        kept = {k: np.ones(len(corners[k]), bool) for pair in pairs for k in pair}
        for a, b in pairs:
            for k, other in ((a, b), (b, a)):
                kept[k] &= ~_inside(scene, corners[k].mean(axis=1), other)
        for k, some in kept.items():
            scene = with_mesh(k, corners[k][some])(scene) if some.any() else scene
        return without(*(k for k, some in kept.items() if not some.any()))(scene)
    return apply


def chained(remedies):
    """A remedy: all of these, none of which takes an object away."""
    def apply(scene):
        for remedy in remedies:
            scene = remedy(scene)
        return scene
    return apply


def _inside(scene, points, number):
    """Which points lie inside an object: what they see of it first, towards a side, is its back."""
    index = build(Scene([scene.objects[number]]))
    d = np.broadcast_to((0.36, 0.48, 0.8), points.shape)                # along no axis
    hits = index.closest(points, d)
    return hits.hit & ((hits.normal * d).sum(axis=1) > 0.0)


def halved(corners, which, rounds=3):
    """Triangles, the longest side of some cut in half, several times."""
    for _ in range(rounds):
        some = which(corners) if len(corners) else np.zeros(0, bool)
        if not some.any() or len(corners) + some.sum() > 200_000:
            break
        own = corners[some]
        edge = np.linalg.norm(own - np.roll(own, -1, axis=1), axis=2).argmax(axis=1)
        i = np.arange(len(own))
        a, b, c = own[i, edge], own[i, (edge + 1) % 3], own[i, (edge + 2) % 3]
        middle = 0.5 * a + 0.5 * b
        corners = np.concatenate([corners[~some], np.stack([a, middle, c], axis=1), np.stack([middle, b, c], axis=1)])
    return corners


def clustered(corners, edge):
    """Triangles whose corners were joined within cells of some size."""
    joined = np.round(corners / edge) * edge
    kept = (joined != np.roll(joined, 1, axis=1)).any(axis=2).all(axis=1)
    joined = np.unique(joined[kept].reshape(-1, 9), axis=0).reshape(-1, 3, 3)
    return joined if len(joined) else corners[:1]
