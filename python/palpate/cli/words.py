"""Words that an option takes: what is said of a wrong one, and what the shell offers."""

from typing import TYPE_CHECKING, Any

import click

from palpate._core import scenes
from palpate.errors import unlike

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem


class OneOf(click.Choice[str]):
    """The type of an option that is one of some words; the shell offers them."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> str:
        """Return the word."""
        if value not in self.choices:
            self.fail(unlike(value, self.choices), param, ctx)
        return str(value)


def scene_names(_context: click.Context, _parameter: click.Parameter, begun: str) -> "list[CompletionItem]":
    """Return the scenes that the shell offers."""
    return _items(scenes, begun)


def settings_of(context: click.Context, _parameter: click.Parameter, begun: str) -> "list[CompletionItem]":
    """Return the settings that the shell offers, with their defaults: those of --scene, if it comes before."""
    from palpate import Tracker

    scene = context.params.get("scene")
    found = Tracker(scene if scene in scenes else "handheld").settings
    return _items([f"{name}={float(value)!r}" for name, value in found.items() if value is not None], begun)


def _items(words: Any, begun: str) -> "list[CompletionItem]":
    from click.shell_completion import CompletionItem

    return [CompletionItem(word) for word in words if word.startswith(begun)]
