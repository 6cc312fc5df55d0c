"""The figures of merit: what is counted, under the names of Havran (2001).

``FIGURES`` is the one table of names and meanings; every panel, table and file
takes its columns from here.
"""

FIGURES = {
    "N": "primitives the structure was built over",
    "N_G": "generic nodes: inner nodes of the hierarchy",
    "N_E": "elementary cells: leaves",
    "N_EE": "empty elementary cells",
    "N_ER": "references to primitives from elementary cells",
    "N_L": "lists of primitives, where cells share them",
    "N_S": "cells made with the list of a neighbour, or of the cell above",
    "evicted": "cells given up for want of room",
    "load_factor": "entries of the hash table over its size",
    "collisions": "entries of the hash table that are not the first of their chain",
    "surplus": "references of cells that intersecting lists adds, as a part of those of exact lists",
    "loose": "references that the loose bound on angles lists, over those of the tight one",
    "depth": "levels below the root",
    "memory": "bytes of the structure",
    "c_SAH": "SAH cost, c_T = c_I = 1",
    "c_GS": "volumes and primitives tested by a random ray that meets the root (Goldsmith and Salmon)",
    "T_B": "build time, s",
    "T_R": "time for the rays, s",
    "N_IT": "intersection tests ray x primitive, per ray",
    "N_TS": "traversal steps (nodes or cells entered), per ray",
    "N_ETS": "of those: elementary cells",
    "N_EETS": "of those: empty elementary cells",
    "r_ITM": "intersection tests over the minimum, one per ray that hits",
}

#: Counted per ray, in the order of the columns.
PER_RAY = ("n_it", "n_ts", "n_ets", "n_eets")


def ray_figures(n_it, n_ts, n_ets, n_eets, n_rays, n_hits):
    """Means per ray of what was counted.

    Parameters
    ----------
    n_it, n_ts, n_ets, n_eets : int
        Sums over all rays.
    n_rays, n_hits : int

    Returns
    -------
    dict
        ``N_IT``, ``N_TS``, ``N_ETS``, ``N_EETS`` per ray and ``r_ITM`` (inf without a hit).
    """
    rays = max(int(n_rays), 1)
    return {"N_IT": n_it / rays, "N_TS": n_ts / rays, "N_ETS": n_ets / rays, "N_EETS": n_eets / rays,
            "r_ITM": n_it / n_hits if n_hits else float("inf")}
