"""The parameters of the kernel of `Sensor`, by their index."""

from __future__ import annotations

import math

#: The cosine of half the field of view (−2 if that is a full turn), the field of view [turns], the standard deviations
#: of distance [length] and bearing [turns], two probabilities, and whether obstacles block the sight (0 or 1).
COSINE, WIDTH, RANGE_NOISE, BEARING_NOISE, MISSED, FALSE_POSITIVES, OCCLUDED = range(7)

PER_RADIAN = 1.0 / (2.0 * math.pi)

#: The least distance of a noisy reading [range]: an agent that seems to be at the same place would have no bearing.
NEAREST = 1e-6
