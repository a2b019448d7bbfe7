"""Import of optional packages, and of what shows an object, when they are used."""

from importlib import import_module
from typing import Any

from palpate.errors import MissingExtra


def need(module: str, extra: str) -> Any:
    """Import a module of an extra of palpate ("": of a package in none); MissingExtra has the pip command that installs it.

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
        what = f"'palpate[{extra}]'" if extra else package
        raise MissingExtra(f"{package} is not installed; type: pip install {what}") from error


def display(function: str, *shown: Any) -> Any:
    """Call a function of palpate.display, as "cards.touches": a class names it, and imports it when it is shown."""
    module, _, name = function.partition(".")
    return getattr(import_module(f"palpate.display.{module}"), name)(*shown)
