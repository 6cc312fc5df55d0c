"""The stress suite: every technique, in both cores, on stiff cases; tables, plots, and files that replay a failure.

Three layers hold each other. Exact arithmetic says what brute force has to find (`truth`); brute force (the pure
core's)
says what every technique has to find (`examine`, `examine_pictures`); and some cases say by themselves what must become
of a ray (closed meshes, rays that are none, rays spawned from a hit). Cases are data: `scenes`, `rays`, `cases`,
`pictures`.
"""

from .failures import failure, replay
from .suite import run
from .tables import text, write

__all__ = ["failure", "replay", "run", "text", "write"]
