"""Adaptive antialiasing, as both cores do it: more samples where the picture needs them, and none taken in vain.

What is judged are displayed values: 0 to 1, brighter than white is white, with a gamma of 2.
"""

import math

#: Corners whose depths differ by more than this ratio belong to different surfaces.
DEPTHS = 1.1
#: Samples of a pixel before its error is judged, at least.
FIRST = 4
#: Samples' worth of belief in the variance of the 3 x 3 pixels around, beside a pixel's own samples.
AROUND = 2.0
#: What is put up with rises with the number of samples as the error of stratified samples falls.
RISE = 0.75
#: A pixel that is so many times off what is put up with gets four times its samples at once, not twice.
FAR = 6.0
#: Noise, the root mean square of the pixels' standard errors with the first samples: in a picture of ordinary noise;
#: and what is always put up with, a step of a display.
ORDINARY, STEP = 0.07, 1.0 / 255.0
#: A round with less than a sample for so many pixels costs more than it brings.
FEW = 32
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
        How fine: how many times pixels are divided into four, or get four times their samples.
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

    The samples are those of uniform sampling. A pixel with n of them gets as many again, or three times as many where
    it is far off, if its standard error, as displayed, is above

        threshold * noise / ORDINARY * (n / FIRST)**RISE * sqrt(rays of a sample there / rays of a sample on average).

    Then a ray more takes about as much from the picture's squared error everywhere (Neyman's allocation, 1934;
    stratified samples err less, the more they are, than their variance tells), and how much that is goes by the whole
    picture's noise: a clean picture is worked out finer than a noisy one, and either is about as much better than the
    same number of samples everywhere.

    The variance is that of a pixel's own samples and, with a weight that fades as they become more, of the 3 x 3 pixels
    around: few samples may all miss an edge, and to stop where they happen to agree makes a bias. All pixels are judged
    again and again: what one finds, those around it learn. The bias that is left was at most 0.0006 of displayed values
    on average in the examples still life and interior, a thirtieth of their root mean squared errors: rare highlights
    that none of the first samples met are missing.

    Attributes
    ----------
    begin, most : int
        Samples of a pixel, at first and at most.
    noise : float or None
        Root mean square of the pixels' standard errors with the first samples; None before it is known.
    rounds : int
        Times that pixels are judged, at most: as often as it takes to get four times as many up to the most, and twice
        more for what was learnt meanwhile. More, of fewer and fewer pixels, take time and gain nothing.
    """

    def __init__(self, *arguments):
        super().__init__(*arguments)
        self.most = FIRST * 4**self.level
        self.begin = min(max(self.samples, FIRST), self.most)
        self.noise = None
        self.rounds = math.ceil(math.log(self.most / self.begin, 4) - 1e-9) + 2

    def allowed(self):
        """Standard error that is put up with in a pixel with FIRST samples that cost as much as on average."""
        return self.threshold * max(self.noise, STEP) / ORDINARY
