"""Pauses of the computer as gaps: it slept, or the program stood still, and the baseline moved on."""

from palpate.clocks import Pause
from palpate.samples import memory_s, pair_of
from palpate.source_events import Gap, GapCause


class PauseGaps:
    """Finds the gaps at pauses of the computer.

    Samples that had waited in a buffer come at once after a pause, and may be from before it. So a
    pause lasts until a sample comes in its time, and this sample is after a gap, too.
    """

    def __init__(self) -> None:
        self._pause: Gap | None = None  # that lasts
        self._is_given = False
        self._waited = 0  # samples after the first one

    def gap(self, pause: Pause, samples: int, hole_s: float, period_s: float) -> Gap | None:
        """Return the gap before samples, if there is one.

        Parameters
        ----------
        pause : Pause
            What happened since the samples before.
        samples : int
            How many come now.
        hole_s : float
            Time from the sample before to the first one by their own times, s.
        period_s : float
            Time from pair to pair, s; 0: unknown.
        """
        forward_s = pause.set_s if is_jump(pause.set_s, period_s) else 0.0
        is_first = max(pause.slept_s, pause.stood_s, forward_s) > 0
        if is_first:
            self._pause = gap_of(pause._replace(set_s=forward_s))
            self._is_given = False
            self._waited = -1
        lasting = self._pause
        if lasting is None:
            return None
        is_over = not is_first and pause.since_s > pair_of(period_s) / 2
        if is_over:
            self._pause = None
        moved = max(pause.slept_s, hole_s, forward_s) > memory_s(period_s)
        if moved:
            self._is_given = True
        elif is_over and self._is_given and self._waited > 0:
            text = f"{lasting.text}; samples that had waited came first"
            return Gap(lasting.cause, text)
        self._waited += samples
        return lasting if moved else None


def gap_of(pause: Pause) -> Gap:
    """Return what happened as a gap."""
    causes = []
    texts = []
    if pause.slept_s > 0:
        causes.append(GapCause.SLEPT)
        texts.append(f"the computer slept for {duration_text(pause.slept_s)}")
    if pause.stood_s > 0:
        causes.append(GapCause.STOPPED)
        texts.append(
            f"the program stood still for {duration_text(pause.stood_s)} (stopped, or the computer "
            "was too busy)"
        )
    if pause.set_s > 0:
        causes.append(GapCause.CLOCK_SET)
        texts.append(f"{_clock_set(pause.set_s)} (or this is a virtual machine that was paused)")
    return Gap(causes[0], "; ".join(texts))


def is_jump(set_s: float, period_s: float) -> bool:
    """Return whether a wall clock was set forward by more than a baseline lasts."""
    return set_s > memory_s(period_s)


def clock_set(set_s: float) -> str:
    """Return what happened to a wall clock that was set, if no time has passed."""
    return f"{_clock_set(set_s)}: that changes no sample, and no time of a sample"


def _clock_set(set_s: float) -> str:
    sign = "+" if set_s > 0 else "-"
    return f"the wall clock was set by {sign}{duration_text(abs(set_s))}"


def duration_text(duration_s: float) -> str:
    """Return a duration as text: seconds, or hours and minutes."""
    if duration_s < 120:
        return f"{duration_s:.1f} s"
    hours, minutes = divmod(round(duration_s / 60), 60)
    if not hours:
        return f"{minutes} min"
    return f"{hours} h {minutes} min"
