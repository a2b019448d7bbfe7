"""The one way out of a measurement: its listeners get the same few events."""

from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

from palpate.files import Json
from palpate.judgements import Judgement
from palpate.source_events import Conditions, Gap, SourceEvent, TroubleBegan, TroubleEnded
from palpate.stream.batches import Batch
from palpate.touch import Touch

if TYPE_CHECKING:
    from palpate.stream.stream import Stream


class Listener:
    """Follows a measurement, as the page and LSL do. Override the events that you need.

    `Stream.listen` adds one. All events come in the thread that iterates over the stream, but
    `message`, which may come from any thread, and `ended`, which comes from the thread that closes
    the stream. The next batch waits until all listeners have returned. An error of a listener ends
    nothing, but in `opened` and `begun`: it is shown once, and counted. The recorder gets the samples, gaps and the end in the thread that reads the
    source, so that no listener can delay it.

    Examples
    --------
    >>> class Printer(Listener):
    ...     def touch(self, number, touch):
    ...         print(number, touch.samples, touch.revised)
    >>> from palpate import Stream
    >>> with Stream("sim:stiff-steady?seed=1") as stream:
    ...     stream.listen(Printer())
    ...     for batch in stream.batches():
    ...         pass
    1 208 False
    1 208 True
    """

    def opened(self, device: Json) -> None:
        """Handle the description of the open source; an error refuses it: nothing is recorded."""

    def begun(self, stream: "Stream") -> None:
        """Handle the begin of the measurement; there is no sample yet."""

    def gap(self, gap: Gap) -> None:
        """Handle a gap: from the next batch on, the earlier baseline is not valid."""

    def trouble_began(self, trouble: TroubleBegan) -> None:
        """Handle a trouble that began, or whose text has changed."""

    def trouble_ended(self, trouble: TroubleEnded) -> None:
        """Handle the end of a trouble."""

    def conditions(self, conditions: Conditions) -> None:
        """Handle conditions that the source measured."""

    def batch(self, batch: Batch) -> None:
        """Handle samples with their estimates."""

    def judgement(self, judgement: Judgement) -> None:
        """Handle what was judged of the readings in the last batch, or of earlier ones."""

    def touch(self, number: int, touch: Touch) -> None:
        """Handle a touch that ended or was revised in the last batch; numbers count from 1."""

    def message(self, text: str) -> None:
        """Handle a message for the user, of the source or of the stream."""

    def ended(self, error: BaseException | None) -> None:
        """Handle the end of measurement and recording, by this error or without one."""


class Listeners:
    """Passes each event to all listeners in order; a message to `show` first.

    Attributes
    ----------
    all : list of Listener
    failures : collections.Counter of str
        How many events a listener did not take because of an error, by the name of its class.
    """

    def __init__(self, show: Callable[[str], object]) -> None:
        self.all: list[Listener] = []
        self.failures: Counter[str] = Counter()
        self._show = show

    def opened(self, device: Json) -> None:
        """Pass on that the source is open; a listener may refuse it with an error."""
        for each in self.all:
            each.opened(device)

    def begun(self, stream: "Stream") -> None:
        """Pass on that the measurement begins; a listener may refuse with an error."""
        for each in self.all:
            each.begun(stream)

    def event(self, event: SourceEvent) -> None:
        """Pass on an event of the source."""
        for each in self.all:
            with self._kept_going(each):
                if isinstance(event, Gap):
                    each.gap(event)
                elif isinstance(event, TroubleBegan):
                    each.trouble_began(event)
                elif isinstance(event, TroubleEnded):
                    each.trouble_ended(event)
                else:
                    each.conditions(event)

    def message(self, text: str) -> None:
        """Pass on a message."""
        with suppress(Exception):  # there is no other place to show that it is not shown
            self._show(text)
        for each in self.all:
            with self._kept_going(each):
                each.message(text)

    def batch(self, batch: Batch) -> None:
        """Pass on a batch, its judgements, and its touches: as they ended, then as revised."""
        revised = dict(batch.revised)
        ended = dict(enumerate(batch.touches, batch.first))
        for each in self.all:
            with self._kept_going(each):
                each.batch(batch)
            for judgement in batch.judgements:
                with self._kept_going(each):
                    each.judgement(judgement)
            for number in sorted({*ended, *revised}):
                if number in ended:
                    with self._kept_going(each):
                        each.touch(number, ended[number])
                if number in revised:
                    with self._kept_going(each):
                        each.touch(number, revised[number])

    def ended(self, error: BaseException | None) -> None:
        """Pass on that the measurement has ended."""
        for each in self.all:
            with self._kept_going(each):
                each.ended(error)

    @contextmanager
    def _kept_going(self, listener: Listener) -> Iterator[None]:
        """Count an error of a listener, and show its first one."""
        try:
            yield
        except Exception as error:  # noqa: BLE001  nothing that shows a measurement may end it
            name = type(listener).__name__
            self.failures[name] += 1
            if self.failures[name] == 1:
                text = f"{name} failed: {type(error).__name__}: {error}; the measurement goes on"
                with suppress(Exception):
                    self._show(text)
