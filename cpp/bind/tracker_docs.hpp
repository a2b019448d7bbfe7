// SPDX-License-Identifier: MIT
#pragma once

// Docstrings of Tracker.

inline constexpr auto tracker_doc =
    R"(All stages of a scene: takes readings of both channels, finds touches, estimates their ratios.

Parameters
----------
scene : str
    "fixed": clean changes of capacitance, always in contact. "paper": baseline, contact, and the paper's estimator
    for 250 samples. "handheld": the channels aligned, `HandoverRls`, 6.5 s; a test of the model, and a revised result
    after the release. "sliding": as handheld, but a touch ends at its release only.
**settings
    The length of a touch: `seconds` or `samples` (int), the other is None; None: it ends at its release only.
    `full_scale` (pF: a reading of this size is saturated and left out), `release` (share of the press below which a
    touch ends), `host_stamps` (the times are a computer's: smooth them), `hard_side` and `soft_side` (coefficients of
    the two filters that align the channels, `slow_` for pairs of 28.5 to 40 ms; see
    `palpate.pair_filter.matched_pair`), and the parameters of the scene's estimator. TypeError: not of this scene.

Examples
--------
>>> import numpy as np, palpate
>>> press = np.repeat([0.0, 0.25, 0.0], [60, 270, 30])
>>> t = np.arange(360) * 0.026
>>> tracker = palpate.Tracker("handheld")
>>> rows = tracker.process(t, t + 0.013, 9 + 2.5 * press, 8 + press)
>>> [(touch.samples, round(touch.ratio, 3)) for touch in tracker.touches]
[(250, 2.5)]
)";

inline constexpr auto feed_doc = R"(feed($self, t_hard, t_soft, hard, soft, /)
--

Take one reading of each channel (times in s, capacitances in pF); return the touch that it ends, or None.)";

inline constexpr auto process_doc = R"(process(self, /, t_hard, t_soft, hard, soft)
--

Take a block of readings; the same bits as one `feed` for each.

Parameters
----------
t_hard, t_soft : array_like, shape (n,)
    Times of the two conversions: seconds as floats, or nanoseconds as integers.
hard, soft : array_like, shape (n,), pF
    Readings with their baseline; nan for a missing one.

Returns
-------
numpy.ndarray, shape (n,), structured
    After each reading: `ratio`; `standard_error` (nan for the first samples, and in scenes without one); `alarm`;
    `contact`; `touch`, the number of the running touch, counted from 1, or 0; `statistic` of the detector (of the
    running touch, or of the last one; 0 without a detector); `hard_baseline` and `soft_baseline`, pF (0 in a scene
    without, nan until the first is known); `revised`, whether this reading revised the last touch.

Raises
------
ValueError
    Arrays that are not one-dimensional or differ in length; a time that is not finite, or beyond int64.
RuntimeError
    The tracker is in use by another thread.
)";

inline constexpr auto take_doc = R"(take(self, /, t_hard, t_soft, hard, soft)
--

Take a block of readings as `process`, without rows: where only the touches count, in about half the time.)";

inline constexpr auto finish_doc = R"(finish(self, /)
--

End the running touch and return it; None if no touch is running.)";

inline constexpr auto gap_doc = R"(gap(self, /)
--

The readings from here on have another baseline: the board was opened again or replaced, or its range was moved.

It ends a touch that is running, and measures the baseline again, with whatever the probe touches now. The flag "gap" is
on that touch, and on the next ones until the release of one of them has shown that this baseline was measured without
contact; or until `tare`. If it shows the opposite, that touch has the flag "baseline".)";

inline constexpr auto tare_doc = R"(tare(self, /, force=False)
--

Measure the baseline again, with nothing touched: after a jump upwards, which the gate takes for an endless touch.

Parameters
----------
force : bool
    Also in contact; False: RuntimeError then. A baseline that was measured in contact is noticed at the release, and
    measured again.
)";

inline constexpr auto revisions_since_doc = R"(revisions_since(self, count, /)
--

Return the numbers, from 1, of the touches that were revised after the first `count` revisions, in order of time.)";

inline constexpr auto touches_since_doc = R"(touches_since(self, count, /)
--

Return the touches after the first `count`, in order of time.)";
