"""Collecting what could not be read: one notice for each thing and cause."""

from ...core.errors import Notice


class Notices:
    """Notices without repetition.

    Attributes
    ----------
    all : list of Notice
    """

    def __init__(self):
        self.all = []
        self._seen = set()

    def add(self, name, text):
        """Note that `text` holds for the thing called `name`, unless that was said already."""
        if (name, text) not in self._seen:
            self._seen.add((name, text))
            self.all.append(Notice(name, text))
