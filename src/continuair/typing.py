"""Types of public signatures."""

from __future__ import annotations

from typing import Literal, TypeAlias

import numpy as np
import numpy.typing as npt

Array: TypeAlias = npt.NDArray[np.float64]
"""Numbers, float64."""

ArrayLike: TypeAlias = npt.ArrayLike
"""What `numpy.asarray` makes an array of: a number, nested lists, an array."""

Model: TypeAlias = Literal["coupled", "decoupled", "independent"]
"""Dynamic model of the vehicle."""

Method: TypeAlias = Literal["Tsit5", "RK4", "implicit"]
"""Integration method."""
