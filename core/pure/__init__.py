"""The pure-Python core: every technique for one ray at a time, with plain Python and ``math``. The text to learn from.
"""
