"""What only an extra brings, imported where it is used."""

from importlib import import_module
from typing import Any

from palpate.errors import MissingExtra


def need(module: str, extra: str) -> Any:
    """Import a module that an extra of palpate brings.

    Parameters
    ----------
    module : str
        Its full name, as "scipy.optimize".
    extra : str
        The extra, as "science".

    Raises
    ------
    MissingExtra
        It is not installed: with the line to type.

    Examples
    --------
    >>> need("math", "science").sqrt(4.0)
    2.0
    >>> need("no_such_package.part", "science")
    Traceback (most recent call last):
    palpate.errors.MissingExtra: no_such_package is not installed; type: pip install 'palpate[science]'
    """
    package = module.split(".")[0]
    try:
        return import_module(module)
    except ModuleNotFoundError as error:
        if error.name != package:
            raise
        raise MissingExtra(f"{package} is not installed; type: pip install 'palpate[{extra}]'") from error
