"""The number types that modules share: arrays, vectors in body axes, and attitudes."""

from math import nan

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

Vector3 = tuple[float, float, float]
"""A vector, or three angles, in body axes unless said otherwise."""

Quaternion = tuple[float, float, float, float]
"""An attitude w x y z, from body axes (FRD) to north-east-down unless said otherwise."""

NAN3: Vector3 = (nan, nan, nan)
