"""What can be set of a picture besides its techniques; numpy is not needed to know it."""

from .parameters import Parameter

#: The technique of rays that have no other; and the name that leaves the choice to :mod:`~rayscope.core.lab.needs`.
STANDARD, AUTOMATIC = "bvh", "automatic"

#: What can be set besides the techniques; panels and the command take their ranges from here.
PARAMETERS = (
    Parameter(
        "depth", 5, "Reflections and refractions in a row, at most (H); 0 means local light alone", low=0, high=10_000
    ),
    Parameter(
        "samples", 1, "Samples a pixel; 1 goes through the pixel's centre and gives hard shadows", low=1, high=1_000_000
    ),
    Parameter("seed", 0, "Chooses other random numbers", low=-(2**31), high=2**31 - 1),
    Parameter(
        "threshold", 0.0, "Rays with less weight in their pixel are not traced (adaptive depth)", low=0.0, high=1.0
    ),
    Parameter("roulette", False, "Trace some of the rays below the threshold, by chance, for the others"),
    Parameter(
        "sampling",
        "stratified",
        "Points of the pixel and of lights, over the samples of a pixel: spread evenly; or each at random by itself",
        choices=("stratified", "random"),
    ),
    Parameter(
        "antialiasing",
        "uniform",
        "Samples: equally many in all pixels; at the corners of pixels, divided where these differ (Whitted); "
        "more where their variance is high",
        choices=("uniform", "corners", "variance"),
    ),
    Parameter(
        "aa_threshold",
        0.033,
        "Adaptive antialiasing: differences in displayed values, 0 to 1, that are put up with: between corners; "
        "as the standard error of a pixel with 4 samples, (n / 4)^0.75 of it with n",
        low=0.0,
        high=1.0,
    ),
    Parameter("light_samples", 1, "Shadow rays to each light that has an extent, per surface met", low=1, high=4096),
    Parameter(
        "aa_level",
        3,
        "Adaptive antialiasing: pixels between corners are divided into four so many times; "
        "by variance, 4 samples become four times as many so many times, at most",
        low=1,
        high=8,
    ),
)
