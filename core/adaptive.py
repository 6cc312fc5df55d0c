"""Adaptive antialiasing, as both cores do it: more samples where the picture needs them, and none taken in vain.

What is judged are displayed values: 0 to 1, brighter than white is white, with a gamma of 2.
"""

import math

#: Corners whose depths differ by more than this ratio belong to different surfaces.
DEPTHS = 1.1
#: Samples of a pixel before its error is judged, at least.
FIRST = 4
#: Parts in the variance of a pixel: its own, the rest being that of the 3 x 3 pixels around it; and that of their means.
#: Tried on the examples still life and interior.
OWN, ACROSS = 0.75, 0.05
#: Twice the samples are not enough where the error is so many times what is put up with: it falls with the root of
#: their number, and what is put up with rises with their number.
FAR = 2.0**1.5
#: Passes that are sums over all rays of a pixel.
SPENT = ("rays_per_pixel", "n_it", "n_ts")


class Adaptive:
    """Base of the ways.

    Parameters
    ----------
    tracer : Whitted
    region : (int, int, int, int)
        x0, y0, x1, y1.
    threshold : float
        Difference of displayed values that is put up with.
    level : int
        How fine: 4**level samples a pixel, at most.
    samples : int
        Samples a pixel to begin with, where that can be chosen.
    """

    def __init__(self, tracer, region, threshold, level, samples):
        self.tracer, self.region, self.threshold, self.level, self.samples = tracer, region, threshold, level, samples

    def parts(self, order):
        """Trace.

        Parameters
        ----------
        order : list of (int, int, int, int)
            The tiles of the region.

        Yields
        ------
        fraction : float
            How much is done.
        tile : (int, int, int, int)
            What is better now.
        values : dict
            Pass -> values of the tile's pixels, as from :meth:`Whitted.tile`.
        spent : (sequence of int, dict)
            Pixels, y * width + x, also more than once; pass -> what rays of those pixels have cost.
        """
        raise NotImplementedError


class ByVariance(Adaptive):
    """Pixels get more samples as long as that makes the picture better by as much as elsewhere.

    The samples are those of uniform sampling; with n of them a pixel gets as many again if its standard error, as
    displayed, is above threshold * n / FIRST * sqrt(rays of a sample there / rays of a sample on average), and three
    times as many if it is so far above that twice the samples would not do. Then a ray more takes about as much from
    the picture's squared error everywhere (Neyman's allocation, 1934; stratified samples err less, the more they are,
    than their variance tells). All pixels are judged again and again: what one finds, those around it learn.

    In the variance the 3 x 3 pixels around have a part, and so has what their means differ by: few samples of its own
    may all miss an edge, and to stop where they happen to agree would make a bias.

    Attributes
    ----------
    begin, most : int
        Samples of a pixel, at first and at most.
    rounds : int
        Times that pixels are judged, at most: as often as it takes to get four times as many up to the most, and once
        more for what was learnt meanwhile. More, of fewer and fewer pixels, take time and gain nothing.
    """

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.most = 4**self.level
        self.begin = min(max(self.samples, FIRST), self.most)
        self.rounds = math.ceil(math.log(self.most / self.begin, 4) - 1e-9) + 1
