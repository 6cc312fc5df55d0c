"""Lights that stand inside something: they light nothing that is seen, whatever technique looks for shadows."""

from .catalogue import build
from .errors import Notice

#: Lights that are looked at, at most.
MOST = 100
#: Rays times primitives, at most, that are tested one by one sooner than a structure is built for so few rays.
TESTS = 20_000_000
AXES = ((1.0, 0.0, 0.0), (-1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, -1.0))


def enclosed(index, scene):
    """Notices of lights inside an object that the camera is not in.

    Along all six axes a light has the back of the same object before it. (A lamp in a room has, too, but then so has the
    camera.)

    Parameters
    ----------
    index : structure
        Over the scene, of either core.
    scene : Scene
        With a camera.

    Returns
    -------
    list of Notice
    """
    lights = [light for light in scene.lights if light.kind != "sun" and light.shadows and any(light.colour)][:MOST]
    places = [tuple(map(float, light.position)) for light in lights]
    eye = tuple(float(scene.camera.matrix[row][3]) for row in range(3))
    origins = [place for place in (eye, *places) for _ in AXES]
    if getattr(index, "is_alone", False) and len(origins) * index.figures["N"] <= TESTS:
        index = build(scene, "brute", index.core, beside=index)
    hits = index.closest(origins, list(AXES) * (len(places) + 1))
    around = []
    for first in range(0, len(origins), len(AXES)):
        backs = {int(hits.object[first + k]) if sum(n * d for n, d in zip(hits.normal[first + k], axis)) > 0.0 else -1
                 for k, axis in enumerate(AXES)}
        around.append(backs.pop() if len(backs) == 1 else -1)
    return [Notice(light.name, f"it stands inside {scene.objects[thing].name}, so its light stays in there. Move it out, or hide the object from rendering.")
            for light, thing in zip(lights, around[1:]) if thing >= 0 and thing != around[0]]
