"""ONE table of all techniques; interface, command, tests and documentation are derived from it.

A technique is one file in each core and one row here. The row's `module` names
that file below ``core/pure`` and ``core/fast``; its `structure` is the class in it.
A module is imported when its technique is first built, not before.
"""

import time
from dataclasses import dataclass
from importlib import import_module

from .errors import ParameterError
from .parameters import Parameter, did_you_mean, resolve

CORES = ("pure", "fast")
ALL_RAYS = ("primary", "secondary", "shadow")


@dataclass(frozen=True)
class Technique:
    """One row of the catalogue.

    Parameters
    ----------
    name, label : str
        The fixed name, and the name as the interface shows it.
    family : str
        The folder below each core, or ``peers``.
    module, structure : str
        File in that folder, and the class in it.
    source : str
        Paper or book section.
    help : str
        One line: what the method does.
    rays : tuple of str
        The kinds of ray it serves: primary, secondary, shadow.
    primitives : str
        ``all``, or the only kind it takes.
    parameters : tuple of Parameter
    cores : tuple of str
    tracer : str
        Module and class, below each core, that makes pictures with it when it serves primary rays: Whitted's, unless the
        technique traces something else than rays.
    """

    name: str
    label: str
    family: str
    module: str
    structure: str
    source: str
    help: str
    rays: tuple = ALL_RAYS
    primitives: str = "all"
    parameters: tuple = ()
    cores: tuple = CORES
    tracer: str = "tracing.whitted.Whitted"

    def load(self, core):
        """Import the technique's module in one core and return its class."""
        folder = "peers" if self.family == "peers" else f"{core}.{self.family}"
        return _class(f"{folder}.{self.module}.{self.structure}")

    @property
    def ray_by_ray(self):
        """Whether pictures are traced ray by ray: then the kinds of ray may have techniques of their own."""
        return self.tracer == Technique.tracer

    def load_tracer(self, core):
        """Import the tracer of pictures made with it in one core, and return its class."""
        return _class(f"{core}.{self.tracer}")


def _class(path):
    """Import a class by its path below this package."""
    module, _, name = path.rpartition(".")
    return getattr(import_module(f".{module}", __package__), name)


LEAF_SIZE = Parameter("leaf_size", 2, "A leaf holds at most this many primitives where it can be divided",
                      low=1, high=1024)

MAILBOX = Parameter("mailbox", True, "No primitive is tested twice with a ray, however many cells it is in")
LISTS = Parameter("lists", "own", "Whether cells with the same primitives share one list, which is tested once a ray",
                  choices=("own", "shared"))
GRID = (
    Parameter("walk", "exact", "How the planes' parameters are advanced", choices=("subtract", "add", "exact")),
    Parameter("rule", "woo", "Cells for a density: cubic, fewer in flat scenes (woo); equally many along each axis; cubic, always as many",
              choices=("woo", "regular", "heterogeneous")),
    # In numpy an empty cell costs little, for blocks of them are leapt; a test costs much.
    Parameter("density", {"pure": 4.0, "fast": 32.0}, "Cells per primitive", low=1e-3, high=1000.0, depends=("resolution", 0)),
    Parameter("resolution", 0, "Cells along the longest axis; 0 means by density", low=0, high=4096),
)
WALKS = ("root", "intervals", "links", "heap")
WALK_HELP = ("How the next cell is found: from the root each time; by cutting the ray into intervals first; along links to neighbours; "
             "depth first with a heap")
STOPS = ("depth", "memory", "cost")
STOP_HELP = "When cells are divided no more: by depth and number of primitives; when max_bytes are used; where it does not pay"
MAX_BYTES = Parameter("max_bytes", 64e6, "With stop = memory: cells are divided until so much is used", low=1e3, high=1e12,
                      unit="bytes", depends=("stop", "memory"))

WALK = Parameter("walk", "depth-first", "Which of the nodes that wait a ray enters next: the nearest child; the nearest of all, from a heap",
                 choices=("depth-first", "best-first"))

FALLBACK = Parameter("samples", 16, "Rays that a pixel is worth where a primitive cannot be tested as a whole; what weighs less gets fewer", low=1, high=1024)

OTHER_TESTS = ("moller-trumbore", "badouel", "baldwin-weber", "plucker")

TECHNIQUES = (
    Technique("brute", "Brute Force", "hierarchies", "brute", "Brute",
              "Whitted 1980", "Every ray is tested against every primitive",
              parameters=(Parameter("triangle_test", "watertight", "How a ray is tested against a triangle; all but the watertight one lose rays at edges",
                                    choices=("watertight", *OTHER_TESTS), inexact=OTHER_TESTS),)),
    Technique("bvh", "Bounding Volume Hierarchy", "hierarchies", "bvh", "BVH",
              "Goldsmith and Salmon 1987; Wald 2007; Meister and Bittner 2018",
              "A tree of axis-aligned boxes around the primitives",
              parameters=(
                  Parameter("builder", {"pure": "sah", "fast": "ploc"}, "How the tree is built",
                            choices=("incremental", "sah", "sweep", "median", "lbvh", "ploc")),
                  Parameter("order", "shuffled", "In which order the incremental builder inserts: as in the scene, along a space-filling curve, at random",
                            choices=("scene", "sorted", "shuffled"), depends=("builder", "incremental")),
                  Parameter("seed", 0, "Of the random order", low=0, high=2**31 - 1, depends=("builder", "incremental")),
                  Parameter("leaf_size", {"pure": 2, "fast": 1},
                            "A leaf holds at most this many primitives where it can be divided", low=1, high=1024),
                  WALK,
              )),
    Technique("sorted-list", "Sorted List", "hierarchies", "sorted_list", "SortedList",
              "Whitted 1980; Kay and Kajiya 1986",
              "A flat list of bounding volumes; primitives are tested in the order in which the ray enters them",
              parameters=(Parameter("volume", "aabb", "Kind of the bounding volumes",
                                    choices=("aabb", "sphere", "obb", "kdop-6", "kdop-14", "kdop-18", "kdop-26", "sphere & aabb", "aabb | aabb")),
                          Parameter("around", "primitive", "What each volume is around: one primitive, or all of an object", choices=("primitive", "object")))),
    Technique("r-tree", "R-Tree", "hierarchies", "r_tree", "RTree",
              "Guttman 1984",
              "Boxes with few entries each, all leaves at one depth; primitives can be inserted and deleted",
              parameters=(
                  Parameter("split", "quadratic", "How a node that overflows is divided", choices=("linear", "quadratic")),
                  Parameter("max_entries", 8, "A node has at most this many entries (M)", low=2, high=64),
                  WALK,
              )),
    Technique("sphere-tree", "Sphere Tree", "hierarchies", "sphere_tree", "SphereTree",
              "Palmer and Grimsdale 1995; Welzl 1991",
              "A tree of the smallest spheres, divided as an octree is",
              parameters=(LEAF_SIZE, WALK)),
    Technique("obb-tree", "OBB Tree", "hierarchies", "obb_tree", "ObbTree",
              "Gottschalk, Lin and Manocha 1996",
              "A binary tree of oriented boxes",
              parameters=(LEAF_SIZE, WALK)),
    Technique("kdop-tree", "k-DOP Tree", "hierarchies", "kdop_tree", "KDopTree",
              "Klosowski et al. 1998",
              "A binary tree of intersections of slabs in fixed directions",
              parameters=(Parameter("k", "14", "Faces of a volume", choices=("6", "14", "18", "26")), LEAF_SIZE, WALK)),
    Technique("grid", "Uniform Grid", "subdivision", "grid", "Grid",
              "Fujimoto et al. 1986; Amanatides and Woo 1987",
              "Equal cells, walked with a 3D digital differential analyser",
              parameters=(*GRID, MAILBOX, LISTS)),
    Technique("separated-grid", "Separated Grid", "subdivision", "separated_grid", "SeparatedGrid",
              "Separation of data by dimension",
              "A grid that keeps lists of slabs along each axis instead of lists of cells, and intersects them",
              parameters=(
                  Parameter("axes", 3, "Axes that are divided: all, or two (rows and columns)", low=2, high=3),
                  Parameter("intersect", "bits", "How lists are kept and intersected: as bit vectors, or as sorted lists",
                            choices=("bits", "sorted")),
                  GRID[1], Parameter("density", 4.0, "Cells per primitive", low=1e-3, high=1000.0, depends=("resolution", 0)), GRID[3], MAILBOX,
              )),
    Technique("macro-grid", "Macro-Cell Grid", "subdivision", "macro_grid", "MacroGrid",
              "Devillers 1989; Sramek 1994",
              "A uniform grid whose empty regions are leapt in one step",
              parameters=(
                  Parameter("region", "cube", "Shape of the regions", choices=("cube", "box")),
                  *GRID[1:], MAILBOX, LISTS,
              )),
    Technique("octree", "Octree", "subdivision", "octree", "Octree",
              "Glassner 1984; Whang et al. 1995; Samet 2006",
              "Cells halved along all three axes at once",
              parameters=(
                  Parameter("walk", "root", WALK_HELP, choices=WALKS),
                  Parameter("storage", "pointers", "Cells with pointers to children; leaves alone, in Morton order; leaves alone, in a hash table "
                            "by Glassner's names. The latter two are walked from the root only", choices=("pointers", "linear", "hashed")),
                  Parameter("split", "centre", "Where cells are divided: in the middle, or at the cheapest of ten planes along each axis (Octree-R)",
                            choices=("centre", "cost")),
                  Parameter("stop", "depth", STOP_HELP, choices=STOPS),
                  Parameter("max_depth", 8, "Levels below the root, at most (K)", low=0, high=18),
                  Parameter("leaf_size", 8, "A cell with more primitives (M) is divided", low=1, high=1024),
                  MAX_BYTES, MAILBOX, LISTS,
              )),
    Technique("kd-tree", "kd-Tree", "subdivision", "kd_tree", "KdTree",
              "Bentley 1975; Havran 2001; Wald and Havran 2006",
              "Cells halved along one axis at a time",
              parameters=(
                  Parameter("walk", "heap", WALK_HELP, choices=WALKS),
                  Parameter("split", "sah", "Where cells are divided: in the middle, the axes in turn; by the surface area heuristic",
                            choices=("middle", "sah")),
                  Parameter("clip", True, "Whether primitives are clipped to their cells (perfect splits)"),
                  Parameter("empty_bonus", 0.2, "Part of the cost that is let off when a division cuts off empty space (SAH)", low=0.0, high=1.0, depends=("split", "sah")),
                  Parameter("stop", "cost", STOP_HELP, choices=STOPS),
                  Parameter("max_depth", 0, "Levels below the root, at most; 0 means 8 + 1.3 log2 N", low=0, high=64),
                  Parameter("leaf_size", 4, "A cell with more primitives is divided", low=1, high=1024),
                  MAX_BYTES, MAILBOX, LISTS,
              )),
    Technique("bsp-tree", "BSP Tree", "subdivision", "bsp_tree", "BspTree",
              "Fuchs, Kedem and Naylor 1980; Ize, Wald and Parker 2008",
              "Cells divided by planes of any orientation",
              parameters=(
                  Parameter("planes", "polygons", "Where planes come from: the planes of polygons; the medians along fixed directions",
                            choices=("polygons", "slabs")),
                  Parameter("directions", 7, "With planes = slabs: axes, then a cube's diagonals, then those of its faces", low=3, high=13,
                            depends=("planes", "slabs")),
                  Parameter("stop", "depth", STOP_HELP, choices=STOPS),
                  Parameter("max_depth", 0, "Levels below the root, at most; 0 means 8 + 1.3 log2 N", low=0, high=64),
                  Parameter("leaf_size", 4, "A cell with more primitives is divided", low=1, high=1024),
                  MAX_BYTES, MAILBOX, LISTS,
              )),
    Technique("image-directory", "Image Directory", "directional", "image_directory", "ImageDirectory",
              "Weghorst, Hooper and Greenberg 1984",
              "What primary rays can meet is listed in the image plane beforehand; other rays are handed to a bvh", rays=("primary",)),
    Technique("light-buffer", "Light Buffer", "directional", "light_buffer", "LightBuffer",
              "Haines and Greenberg 1986",
              "Around each light, lists of what is seen in each direction; other rays are handed to a bvh", rays=("shadow",),
              parameters=(
                  Parameter("faces", {"pure": "adaptive", "fast": "uniform"}, "How the direction cube's faces are divided: evenly, or as a quadtree",
                            choices=("uniform", "adaptive")),
                  Parameter("z_buffer", False, "With uniform faces: full occluders are found with a z-buffer, and lists end behind them",
                            depends=("faces", "uniform")),
                  Parameter("resolution", 0, "Cells along an edge of the direction cube; 0 means by the number of primitives", low=0, high=4096),
                  Parameter("max_bytes", 256e6, "Above it the buffers of lights not used for longest are given up", low=1e3, high=1e12, unit="bytes"),
              )),
    Technique("ray-coherence", "Ray Coherence", "directional", "ray_coherence", "RayCoherence",
              "Ohta and Maekawa 1987",
              "Around each primitive, lists of what rays that leave it can meet in each direction; other rays are handed to a bvh",
              rays=("secondary", "shadow"),
              parameters=(
                  Parameter("resolution", 4, "Cells along an edge of each direction cube", low=1, high=64),
                  Parameter("bound", "tight", "Of the angle between two spheres: with the square of the radii by the distance, or without",
                            choices=("tight", "loose")),
                  Parameter("longest", 512, "Lists with more entries are not kept, and their rays are handed over", low=1, high=1_000_000),
                  Parameter("max_bytes", 256e6, "Above it the lists not used for longest are given up", low=1e3, high=1e12, unit="bytes"),
              )),
    Technique("ray-classification", "Ray Classification", "directional", "ray_classification", "RayClassification",
              "Arvo and Kirk 1987",
              "Cells of origins and directions, made as rays come, list what their beams may meet; with time for a list of scenes, frames of an animation",
              parameters=(
                  Parameter("leaf_size", {"pure": 8, "fast": 16}, "A cell with a longer list is divided", low=1, high=1024),
                  Parameter("max_depth", 16, "Levels below the root, at most", low=0, high=24),
                  Parameter("similarity", 0.9, "Neighbours that have this part of their primitives in common share one list", low=0.0, high=1.0),
                  Parameter("max_bytes", 256e6, "Above it the cells not used for longest are given up", low=1e3, high=1e12, unit="bytes"),
              )),
    Technique("cones", "Cones", "generalised", "cones", "ConeTree",
              "Amanatides 1984",
              "One cone a pixel, to each light that has an extent and off each mirror: shares of it are covered. Triangles, polygons, "
              "spheres; rays have the bvh beneath",
              parameters=(
                  FALLBACK,
                  Parameter("gloss", True, "Cones are scattered by what they are reflected by, as rough as it is; without, as by mirrors"),
              ), tracer="generalised.cones_tracer.ConeTracer"),
    Technique("pyramids", "Pyramids", "generalised", "pyramids", "PyramidTree",
              "Catmull 1978; Weiler and Atherton 1977",
              "What polygons cover of each pixel is found by exact clipping; all else is traced by rays, which have the bvh beneath",
              parameters=(FALLBACK,), tracer="generalised.pyramids_tracer.PyramidTracer"),
    Technique("beams", "Beams", "generalised", "beams", "Beams",
              "Heckbert and Hanrahan 1984; Atherton, Weiler and Greenberg 1978",
              "The view pyramid is cut by polygons, reflected and refracted as a whole: exact visible areas. Triangles and polygons; what "
              "shows others is sampled; rays have the bvh beneath",
              parameters=(
                  Parameter("max_fragments", 200_000, "Polygons that beams may be cut into; what is left is traced by sampled rays",
                            low=1_000, high=100_000_000),
                  Parameter("levels", 1, "Reflections and refractions of the beams that the overlay draws", low=0, high=16),
              ), tracer="generalised.beam_tracer.BeamTracer"),
    Technique("embree", "Embree", "peers", "embree", "Embree",
              "Wald et al. 2014", "Intel's ray tracing kernels, through the package embreex",
              primitives="triangle", cores=("fast",)),
    Technique("mathutils", "Blender BVHTree", "peers", "mathutils_bvh", "MathutilsBVH",
              "Blender's mathutils.bvhtree", "Blender's own tree, one ray at a time from Python",
              primitives="triangle", cores=("fast",)),
)

_BY_NAME = {t.name: t for t in TECHNIQUES}


def techniques():
    """All techniques.

    Returns
    -------
    list of Technique
        In the catalogue's order.
    """
    return list(TECHNIQUES)


def technique(name):
    """The row of one technique.

    Parameters
    ----------
    name : str

    Returns
    -------
    Technique

    Raises
    ------
    ParameterError
        For an unknown name; the message lists the known ones.
    """
    if name not in _BY_NAME:
        raise ParameterError(f"There is no technique {name!r}{did_you_mean(name, _BY_NAME)}. "
                             f"Techniques: {', '.join(_BY_NAME)}.")
    return _BY_NAME[name]


def build(scene, name="bvh", core="fast", progress=None, beside=None, **parameters):
    """Build one technique over a scene.

    Parameters
    ----------
    scene : Scene
    name : str
        A technique's name, see :func:`techniques`.
    core : {"fast", "pure"}
    progress : callable, optional
        Called as ``progress(fraction)`` now and then; it stops the build by raising
        :class:`~rayscope.core.errors.Cancelled`.
    beside : structure, optional
        One over the same scene, in the same core: what both need is taken from it.
    **parameters
        The technique's own.

    Returns
    -------
    Structure
        With ``closest``, ``occluded``, ``cells``, ``figures``.

    Raises
    ------
    ParameterError
        For unknown names and bad values.
    MemoryEstimateError
        When the structure would not fit into memory.
    """
    row = technique(name)
    if core not in row.cores:
        raise ParameterError(f"{name} has no core {core!r}. It has: {', '.join(row.cores)}.")
    values = resolve(name, row.parameters, parameters, core)
    structure = row.load(core)
    start = time.perf_counter()
    if beside is None:
        index = structure.over(scene, row, values, progress)
    else:
        index = structure.beside(beside, row, values, progress)
    index.figures["T_B"] = time.perf_counter() - start
    return index
