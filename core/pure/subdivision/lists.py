"""What a ray does in the cells that it walks through: where it is among them, tests, mailboxes, marks on shared lists.
"""


def shared(lists):
    """The same lists of primitives, those that are alike being one and the same object."""
    known = {}
    return [known.setdefault(tuple(items), tuple(items)) for items in lists]


def walked(query, lo, hi, margin):
    """Where a ray is in the box that is divided into cells, or None where there is nothing to walk through.

    A ray from so far away that its own rounding errors are as large as the `margin` by which cells overlap is not
    walked: all primitives are tested.
    """
    inside = query.ray.through_box(lo, hi, query.t)
    if inside is not None and query.ray.slack > 0.5 * margin:
        for item in range(len(query.primitives)):
            query.test(item)
        return None
    return inside


class Visits:
    """The visits of one ray.

    Parameters
    ----------
    structure : Structure
        With ``mail``, the query that each primitive was tested for last, if its parameter `mailbox` is set.
    query : Closest or Occluded
    """

    __slots__ = ("query", "mail", "marks")

    def __init__(self, structure, query):
        self.query = query
        self.mail = structure.mail if structure.parameters["mailbox"] else None
        self.marks = set() if structure.parameters.get("lists") == "shared" else None

    def enter(self, number, items, t_in, t_out):
        """The ray enters cell `number`: test the primitives that are there, unless they were tested before."""
        watch = self.query.watch
        if self.marks is not None:
            # A list tested before is not walked again: a step, but no elementary cell.
            if id(items) in self.marks:
                if watch:
                    watch.cell(number, t_in, t_out, leaf=False, empty=False)
                return
            self.marks.add(id(items))
        if watch:
            watch.cell(number, t_in, t_out, leaf=True, empty=not items)
        for item in items:
            self.test(item)

    def test(self, item):
        """Test a primitive, unless its mailbox says that this ray was there."""
        if self.mail is None:
            self.query.test(item)
        elif self.mail[item] is not self.query:
            self.mail[item] = self.query
            self.query.test(item)
        elif self.query.watch:
            self.query.watch.mailbox(item)
