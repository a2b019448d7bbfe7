"""From a recording to its touches, one estimate each."""

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from palpate._core import AdaptiveRls
from palpate.contact import find_contacts

PAPER_SAMPLES = 250
"""Samples from contact that the paper uses for each touch (Sec. III-D)."""


class Channels(Protocol):
    """What `touches` needs of a recording."""

    @property
    def time_s(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def hard(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def soft(self) -> NDArray[np.float64]: ...  # noqa: D102


@dataclass(frozen=True, slots=True)
class Touch:
    """The result of one touch.

    Attributes
    ----------
    start_s : float
        Time of the first sample in contact, s; nan in a recording without times.
    samples : int
        Samples that the estimate rests on.
    ratio : float
        Capacitance ratio, hard / soft, at the end of the touch.
    covariance : float
        Unscaled covariance P of the ratio, 1/pF^2: the smaller, the harder was pressed. Not yet an
        uncertainty: it knows nothing of the errors.
    alarm_share : float
        Share of the samples during which the change detector's alarm was on.
    flags : tuple of str
        "short": fewer samples than the scene asks for; "unexcited": the samples hardly moved the
        initial ratio, as when farads are taken for picofarads.
    """

    start_s: float
    samples: int
    ratio: float
    covariance: float
    alarm_share: float
    flags: tuple[str, ...] = ()


def touches(recording: Channels, *, scene: str = "paper", samples: int = PAPER_SAMPLES, **settings: Any) -> list[Touch]:
    """Find the touches of a recording and estimate the ratio of each.

    Parameters
    ----------
    recording : Recording
        `time_s` (s), `hard` and `soft` (pF, baseline included), arrays of shape (n,); nan where a
        channel has no value: such samples are left out.
    scene : str
        "paper": baseline, contact (`palpate.contact`), `AdaptiveRls` restarted at each touch.
    samples : int
        A touch ends after so many samples, or when it is released.
    **settings
        Parameters of `AdaptiveRls`.

    Returns
    -------
    list of Touch
        In order of time; empty where nothing rose out of the noise.

    Raises
    ------
    ValueError
        An unknown scene or setting, samples < 1, a setting out of range.

    Examples
    --------
    >>> import numpy as np, palpate
    >>> press = np.concatenate([np.zeros(60), np.linspace(0, 0.3, 20), np.full(80, 0.3), np.zeros(60)])
    >>> recording = palpate.Recording(time_s=np.arange(220) / 40, hard=9 + 2.5 * press, soft=8 + press)
    >>> [touch] = palpate.touches(recording)
    >>> touch.start_s, touch.samples, round(touch.ratio, 3), touch.flags
    (1.525, 99, 2.5, ('short',))
    """
    if scene != "paper":
        raise ValueError(f"scene: got {scene!r}, allowed: 'paper'")
    if samples < 1:
        raise ValueError(f"samples: got {samples}, allowed: 1 <= samples")
    if unknown := set(settings) - set(AdaptiveRls().settings):
        raise ValueError(f"settings: got {min(unknown)!r}, allowed: {', '.join(AdaptiveRls().settings)}")
    estimator = AdaptiveRls(**settings)
    good = np.isfinite(recording.hard) & np.isfinite(recording.soft)
    time_s, hard, soft = recording.time_s[good], recording.hard[good], recording.soft[good]
    result = []
    for contact in find_contacts(hard, soft):
        used = slice(contact.start, min(contact.stop, contact.start + samples))
        estimator.reset()
        rows = estimator.trace(hard[used] - contact.hard_baseline, soft[used] - contact.soft_baseline)
        flags = {
            "short": len(rows) < samples,
            "unexcited": estimator.covariance > 0.1 * estimator.settings["initial_covariance"],
        }
        result.append(
            Touch(
                start_s=float(time_s[contact.start]),
                samples=estimator.samples,
                ratio=estimator.ratio,
                covariance=estimator.covariance,
                alarm_share=float(rows["alarm"].mean()),
                flags=tuple(flag for flag, raised in flags.items() if raised),
            )
        )
    return result
