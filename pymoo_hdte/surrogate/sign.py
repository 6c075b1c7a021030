"""The sign of a response where its surrogate was fitted."""

from __future__ import annotations

import numpy as np

from pymoo_hdte.surrogate.chebyshev import ChebyshevSurrogate
from pymoo_hdte.surrogate.tensor import chebyshev_basis, chebyshev_nodes


def sign_at_nodes(surrogate: ChebyshevSurrogate) -> float:
    """Return 1 or -1 if the response is of that sign at all nodes of the fit, otherwise 0.

    Parameters
    ----------
    surrogate : ChebyshevSurrogate
        It interpolates: its values at the nodes of its orders are those of the response.
    """
    values = surrogate.coefficients
    for axis, size in enumerate(values.shape):
        basis = chebyshev_basis(chebyshev_nodes(size), size)
        values = np.moveaxis(np.tensordot(basis.T, values, axes=(1, axis)), 0, axis)
    return 1.0 if values.min() > 0.0 else -1.0 if values.max() < 0.0 else 0.0
