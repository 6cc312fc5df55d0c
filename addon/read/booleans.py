"""Boolean modifiers -> CSG trees: of closed meshes and tagged primitives, one node for each operand in stack order.

A tree stands for an object only if it gives what Blender's own modifiers give; where it cannot, a notice says why, and
the mesh that Blender evaluates is used instead, so that the picture is complete.
"""

import numpy as np

from ...core.scene import csg, placed, solids
from ...core.scene.scene import Object, Shapes
from .meshes import read_mesh
from .primitives import kind_of, unit_solid

OPERATIONS = {"UNION": solids.union, "INTERSECT": solids.intersection, "DIFFERENCE": solids.difference}


class _Refused(Exception):
    """Why an object cannot be a tree."""


class Booleans:
    """The CSG trees of one read.

    Parameters
    ----------
    depsgraph : bpy.types.Depsgraph
    materials : Materials
    notices : Notices
    """

    def __init__(self, depsgraph, materials, notices):
        self.depsgraph, self.materials, self.notices = depsgraph, materials, notices
        self._show = "show_render" if depsgraph.mode == "RENDER" else "show_viewport"
        self._trees = {}

    def has(self, obj):
        """Whether an object's Boolean modifiers are evaluated."""
        return any(m.type == "BOOLEAN" and getattr(m, self._show) for m in obj.modifiers)

    def of(self, obj):
        """The tree of an object that has Boolean modifiers.

        Parameters
        ----------
        obj : bpy.types.Object
            Evaluated.

        Returns
        -------
        (Shapes, tuple of Read) or None
            The tree, in the object's own space, with the materials of its solids' slots; None where Blender's mesh has
            to be used.
        """
        key = obj.original.name_full
        if key not in self._trees:
            try:
                self._trees[key] = self._tree(obj.original)
            except _Refused as reason:
                self._trees[key] = None
                self.notices.add(
                    obj.name,
                    f"its Boolean modifiers are not traced as CSG: {reason} Blender's own Boolean mesh was used.",
                )
        return self._trees[key]

    def _tree(self, obj):
        slots = _Slots()
        solid = self._solid(obj, obj, slots, None, (), whole=True)
        world = self._matrix(obj)
        # The core's own check; as it stands in the world, where it will be traced.
        if fault := placed.Tree.of([Object(obj.name, Shapes([solid]), world)], 0, 0, solid).fault():
            raise _Refused(fault + ".")
        self._note_smooth(obj, solid)
        return Shapes([solid], obj.name), tuple(slots.reads)

    def _solid(self, obj, root, slots, taken, path, whole=False):
        """What an object is, in the root's space.

        Parameters
        ----------
        obj, root : bpy.types.Object
            Originals.
        slots : _Slots
            The tree's materials, added to.
        taken : callable or None
            Material of the object's slot -> slot of the tree; None: the object's materials become the tree's.
        path : tuple of str
            Objects on the way from the root.
        whole : bool
            Refuse what is not a tree all through; else Blender's mesh of the object is a leaf.
        """
        if obj.name_full in path:
            raise _Refused(f"{obj.name} is an operand of itself.")
        path = (*path, obj.name_full)
        evaluated = obj.evaluated_get(self.depsgraph)
        reads = self._reads(obj)
        if taken is None:
            slots.reads += reads
            taken = range(len(reads)).__getitem__
        if not self.has(obj):
            return self._leaf(evaluated, evaluated, root, reads, taken)
        if reason := self._mixed(obj):
            if whole:
                raise _Refused(reason)
            self.notices.add(obj.name, f"{reason} As an operand it is Blender's own Boolean mesh.")
            return self._leaf(evaluated, evaluated, root, reads, taken)
        solid = self._leaf(evaluated, obj, root, reads, taken)
        for modifier in (m for m in obj.modifiers if m.type == "BOOLEAN" and getattr(m, self._show)):
            operands = []
            for operand in self._operands(modifier):
                share = slots.sharing(reads, taken, self._reads(operand), _transfers(modifier))
                operands.append(self._solid(operand, root, slots, share, path))
            solid = OPERATIONS[modifier.operation](solid, *operands, name=f"{obj.name}: {modifier.name}")
        return solid

    def _mixed(self, obj):
        """Why an object with Boolean modifiers is not the solids it is made of, or an empty string."""
        if kind_of(obj) != "none":
            return ""
        if obj.mode == "EDIT":
            return "it is in Edit Mode."
        if obj.data.shape_keys:
            return "it has shape keys."
        others = [m.name for m in obj.modifiers if m.type != "BOOLEAN" and getattr(m, self._show)]
        return f"it has other modifiers besides ({', '.join(others)}); apply or remove them." if others else ""

    def _operands(self, modifier):
        """The original objects that a modifier combines its object with."""
        owner = modifier.id_data
        if modifier.operand_type == "OBJECT":
            found = [modifier.object] if modifier.object else []
        else:
            if modifier.operation == "INTERSECT" and modifier.solver in {"FAST", "FLOAT"}:
                raise _Refused(
                    f"{modifier.name}: the solver {modifier.solver.title()} cannot intersect with a collection."
                )
            found = (
                [o for o in modifier.collection.all_objects if o.type == "MESH" and o != owner]
                if modifier.collection
                else []
            )
        if not found:
            what = "an object" if modifier.operand_type == "OBJECT" else "a collection with meshes"
            raise _Refused(f"the modifier {modifier.name} has no operand; give it {what}.")
        return found

    def _leaf(self, evaluated, source, root, reads, taken):
        """A closed mesh or a tagged primitive; `source` is the object whose mesh is taken, evaluated or not."""
        matrix = self._relative(evaluated.original, root)
        kind = kind_of(evaluated)
        if kind == "polygon":
            raise _Refused(f"{evaluated.name} is tagged as a polygon, which encloses nothing.")
        if kind != "none":
            return unit_solid(evaluated, matrix, slot=taken(0), name=evaluated.name)
        mesh, _ = read_mesh(source.data)
        used = (
            np.unique(np.minimum(mesh.slots, len(reads) - 1))
            if mesh.slots is not None and len(mesh)
            else np.zeros(1, int)
        )
        used = sorted({taken(int(s)) for s in used})
        if len(used) > 1:
            raise _Refused(f"{evaluated.name} has {len(used)} materials, and a solid of a tree has one.")
        if any(r.material.texture or r.material.vertex_colours for r in reads):
            raise _Refused(
                f"{evaluated.name} has a textured or vertex-coloured material; the solids of a tree have no UV map."
            )
        corners = mesh.vertices[mesh.triangles]
        middle = mesh.vertices.mean(axis=0) if len(mesh) else 0.0
        if np.einsum(
            "ij,ij->", corners[:, 0] - middle, np.cross(corners[:, 1] - middle, corners[:, 2] - middle)
        ) < 0.0 and not csg.mesh_fault(mesh):
            raise _Refused(f"{evaluated.name} is inside out; turn its faces with Mesh > Normals > Recalculate Outside.")
        return solids.mesh(mesh, matrix, slot=used[0], name=evaluated.name)

    def _reads(self, obj):
        """The materials of an original object's slots."""
        if not self.has(obj):
            return self.materials.of(obj.evaluated_get(self.depsgraph))
        # Its own: Blender's Booleans add those of the operands to the evaluated object's.
        return self.materials.of_slots(
            [s.material and s.material.evaluated_get(self.depsgraph) for s in obj.material_slots]
        )

    def _matrix(self, obj):
        return np.array(obj.evaluated_get(self.depsgraph).matrix_world, float)

    def _relative(self, obj, root):
        """The matrix from an object's space to the root's."""
        if obj == root:
            return np.eye(4)
        try:
            return np.linalg.inv(self._matrix(root)) @ self._matrix(obj)
        except np.linalg.LinAlgError:
            raise _Refused("its scale is zero along an axis.") from None

    def _note_smooth(self, obj, solid):
        smooth = sorted(
            {
                leaf.name
                for leaf in csg.flatten(solid)[1]
                if leaf.kind == "mesh" and leaf.values["mesh"].corner_normals is not None
            }
        )
        if smooth:
            self.notices.add(
                obj.name,
                f"shaded smooth, but as part of a CSG tree seen with flat faces: {', '.join(smooth)}. "
                "Tag them as a Rayscope primitive, or switch off CSG from Booleans.",
            )


def _transfers(modifier):
    """Whether the operand's materials go with its faces; else faces take the base's material of the same slot."""
    return modifier.material_mode == "TRANSFER" and modifier.solver not in {"FAST", "FLOAT"}


class _Slots:
    """The materials of a tree.

    Attributes
    ----------
    reads : list of Read
    """

    def __init__(self):
        self.reads = []

    def sharing(self, base, taken, operand, transfers):
        """Slot of an operand -> slot of the tree, as Blender's Boolean modifiers map them."""

        def slot(k):
            read = operand[min(k, len(operand) - 1)]
            own = next((taken(i) for i, r in enumerate(base) if r is read), None)
            if own is not None:
                return own
            if not transfers or read.empty:
                return taken(0 if transfers else min(k, len(base) - 1))
            if not any(r is read for r in self.reads):
                self.reads.append(read)
            return next(i for i, r in enumerate(self.reads) if r is read)

        return slot
