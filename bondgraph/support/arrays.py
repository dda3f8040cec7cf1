"""Short names of arrays for annotations."""

import numpy as np
from numpy.typing import NDArray

Array = np.ndarray
FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.intp]
