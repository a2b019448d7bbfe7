"""The source of a stream: its description and counters are checked, its end has a time limit."""

from contextlib import suppress
from typing import Any

from palpate.errors import ProtocolError
from palpate.sources import Source
from palpate.sources.claims import counted, described
from palpate.stream.limited import limited

CLOSE_S = 2.0


class Instrument:
    """Begins and closes a source, and reads its counters.

    Parameters
    ----------
    source : Source
    """

    def __init__(self, source: Source) -> None:
        self._source = source
        self._counts = 0, 0
        self._begun = self._told = False

    def begin(self) -> dict[str, Any]:
        """Begin the measurement; return the description.

        Raises
        ------
        ProtocolError
            The description or the counters are invalid.
        """
        self._source.__enter__()
        self._begun = True
        description, self._counts = described(self._source), counted(self._source)
        return description

    def counts(self) -> tuple[int, int]:
        """Return errors and reconnections; if they become invalid, the last valid ones, and a message once."""
        try:
            self._counts = counted(self._source)
        except ProtocolError as error:
            if not self._told:
                self._told = True
                with suppress(Exception):  # the end of a recording has these counters, whatever a callback does
                    self._source.notify(f"{error}; errors and reconnects stay at {self._counts}")
        return self._counts

    def close(self) -> None:
        """Close the source.

        Raises
        ------
        SourceTimeout
            It does not return within 2 s; its thread still runs.
        Exception
            What the source raises.
        """
        limited(self._close, CLOSE_S, "the source did not close")

    def _close(self) -> None:
        if self._begun:
            self._source.__exit__(None, None, None)
        else:
            self._source.close()
