"""A glance at the picture: a few of the camera's rays tell how much there is to see, and what sends rays on."""

from dataclasses import dataclass

from ...scene.scene import Mesh
from ...scene.solids import slots
from ..rays import pixel_rays

#: Pixels of the picture that is looked at: so few that it costs next to nothing.
PIXELS = (12, 9)


@dataclass
class Glance:
    """What the camera's rays meet.

    Attributes
    ----------
    met : float
        Share of them that meet anything.
    sent_on : float
        Rays that are sent on for each that meets something: one by a mirror, two by glass, one by what is transparent.
    """

    met: float = 1.0
    sent_on: float = 0.0


def glance(scene, index):
    """Trace a few of the camera's rays.

    Parameters
    ----------
    scene : Scene
    index : structure
        Over it, of either core.

    Returns
    -------
    Glance or None
        None without a camera, and where nothing sends rays on: then there is little to be learnt.
    """
    if scene.camera is None or not any(m.reflects or m.transparent for m in scene.used_materials()):
        return None
    rays = pixel_rays(scene.camera, PIXELS)
    hits = index.closest(rays.origins.tolist(), rays.directions.tolist(), rays.t_min, rays.t_max)
    found = [(int(o), int(p), int(part)) for o, p, part in zip(hits.object, hits.primitive, hits.part) if p >= 0]
    sent_on = 0
    for number, primitive, part in found:
        material = _material(scene.objects[number], primitive, part)
        if material is not None:
            sent_on += 2 if material.transmission else bool(material.mirror or material.mirror_base)
            sent_on += bool(material.transparent)
    return Glance(len(found) / len(rays), sent_on / max(len(found), 1))


def _material(thing, primitive, part):
    """The material of a primitive's part."""
    if not thing.materials:
        return None
    geometry = thing.geometry
    if isinstance(geometry, Mesh):
        slot = 0 if geometry.slots is None else int(geometry.slots[primitive])
    else:
        own = slots(geometry.solids[primitive])
        slot = own[min(part, len(own) - 1)]
    return thing.materials[min(max(slot, 0), len(thing.materials) - 1)]
