"""The argument SOURCE, with shell completion."""

from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from click.shell_completion import CompletionItem

_SCHEMES = ("usb:", "sim:", "i2c:", "iio:", "serial:", "lsl:")


class SourceType(click.types.StringParamType):
    """The name of a source; it is checked when the source is opened."""

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> "list[CompletionItem]":
        """Return schemes; after a scheme, scenarios or connected devices; else files."""
        from click.shell_completion import CompletionItem

        scheme, colon, _ = incomplete.partition(":")
        offered = _addresses(scheme) if colon else _SCHEMES
        found = [CompletionItem(name) for name in offered if name.startswith(incomplete)]
        return found or [CompletionItem(incomplete, type="file")]


def _addresses(scheme: str) -> list[str]:
    if scheme == "sim":
        from palpate.simulation.board import known

        return [f"sim:{name}" for name in known()]
    if f"{scheme}:" in _SCHEMES:
        from palpate.sources.devices import devices

        return [device.uri for device in devices()[0] if device.uri.startswith(f"{scheme}:")]
    return []
