"""Linear least squares by singular values, for the reference of the test of the model."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def solved(columns: dict[str, Array], y: Array) -> tuple[dict[str, float], dict[str, float], float]:
    """Return the least-squares solution of y = sum of coefficient times column.

    Parameters
    ----------
    columns : dict of str to numpy.ndarray, shape (n,)
    y : numpy.ndarray, shape (n,)

    Returns
    -------
    coefficients, variances : dict of str to float
        Variances for noise of variance 1: the diagonal of (X' X)^-1.
    squares : float
        Sum of the squared residuals.

    Examples
    --------
    >>> values, variances, squares = solved({"x": np.array([1.0, 1.0])}, np.array([1.0, 3.0]))
    >>> round(values["x"], 12), round(variances["x"], 12), round(squares, 12)
    (2.0, 0.5, 2.0)
    """
    matrix = np.column_stack(list(columns.values()))
    scale = np.sqrt((matrix**2).sum(axis=0))  # columns of size 1: so that no singular value is lost beside another's
    scale[scale == 0] = 1
    inverse = np.linalg.pinv(matrix / scale, rcond=1e-15) / scale[:, None]
    found = inverse @ y
    residuals = y - matrix @ found
    variances = (inverse**2).sum(axis=1)
    squares = float(residuals @ residuals)
    return dict(zip(columns, found.tolist(), strict=True)), dict(zip(columns, variances.tolist(), strict=True)), squares


def rest(name: str, columns: dict[str, Array]) -> float:
    """Return the part of one column that the others do not explain: the sum of its squared residuals.

    Parameters
    ----------
    name : str
    columns : dict of str to numpy.ndarray, shape (n,)

    Returns
    -------
    float

    Examples
    --------
    >>> round(rest("x", {"x": np.array([1.0, 3.0]), "one": np.ones(2)}), 12)
    2.0
    """
    others = {other: values for other, values in columns.items() if other != name}
    return solved(others, columns[name])[2]
