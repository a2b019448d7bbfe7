// SPDX-License-Identifier: MIT
#pragma once

// From readings to pairs: alignment, and means of a fast converter.

#include <palpate/settings.hpp>
#include <palpate/stage/decimator.hpp>
#include <palpate/stage/matched_pair.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

namespace detail {
template <class Stage, class Time = typename Stage::time_type>
using Aligns = decltype(of<Stage>().reset(), float(of<Stage>().feed(Time(), Time(), 0, 0, true).hard),
                        float(of<Stage>().feed(Time(), Time(), 0, 0, true).soft),
                        bool(of<Stage>().feed(Time(), Time(), 0, 0, true).valid));
template <class Stage, class Time = typename Stage::time_type>
using Matches = decltype(bool(of<Stage>().feed(Time(), Time(), 0, 0, true).matched));
}  // namespace detail

/// A reading of each channel against the range of the converter. Saturated values are none for the alignment; they still show a contact.
template <class Real>
struct RangedReading {
  Real hard, soft;  ///< pF; NaN: no value
  bool whole;       ///< both channels have a value in the range
  bool saturated;   ///< one of them has a value that is not in the range

  /// A value for the alignment.
  PALPATE_INLINE constexpr Real usable(Real value) const noexcept {
    return PALPATE_UNLIKELY(saturated) ? not_a_number<Real> : value;
  }
};

/// An alignment alone: its pair is computed where it is used.
template <class Real, class AlignStage, bool matches = detail::has<detail::Matches, AlignStage>>
struct Front {
  using Time = typename AlignStage::time_type;
  using Pair = decltype(detail::of<AlignStage>().feed({}, {}, 0, 0, true));
  static constexpr bool decimates = false;  ///< pairs are averaged
  AlignStage align;                         ///< brings both channels to the same times
  NoDecimator decimator;                    ///< each reading counts

  /// The reading itself.
  PALPATE_INLINE static constexpr Frame<Time, Real, Pair> take(Time hard_time, Time, const RangedReading<Real>& read,
                                                               bool, Real) noexcept {
    return {hard_time, read.hard, read.soft, {}, 1};
  }
  /// The pair that is complete with a reading; `wanted`: it is used.
  PALPATE_INLINE constexpr Pair pair(const Frame<Time, Real, Pair>&, Time hard_time, Time soft_time,
                                     const RangedReading<Real>& read, bool wanted) noexcept {
    return align.feed(hard_time, soft_time, read.usable(read.hard), read.usable(read.soft), wanted);
  }
};

/// An alignment of filters, whose pairs may be averaged.
template <class Real, class AlignStage>
struct Front<Real, AlignStage, true> {
  using Time = typename AlignStage::time_type;
  using Pair = FilteredPair<Real>;
  static constexpr bool decimates = true;  ///< pairs are averaged
  AlignStage align;                        ///< brings both channels to the same times
  Decimator<Real, Time, Pair> decimator;   ///< of a fast converter

  /// The reading with its pair, or the mean that is complete with it. `near`: a touch is near, so that the pair is used;
  /// `longest`: of a mean, s.
  PALPATE_INLINE constexpr Frame<Time, Real, Pair> take(Time hard_time, Time soft_time, const RangedReading<Real>& read,
                                                        bool near, Real longest) noexcept {
    const auto ticks = static_cast<typename Time::Unsigned>(
        static_cast<typename Time::Signed>(product(longest, static_cast<Real>(Time::second))));
    const bool quick = read.whole && decimator.follow(hard_time, ticks);
    const auto pair = align.feed(hard_time, soft_time, read.usable(read.hard), read.usable(read.soft), near);
    if (PALPATE_UNLIKELY(quick)) {
      const auto mean = decimator.add(hard_time, read.hard, read.soft, same(pair), ticks);
      return {mean.time, mean.hard, mean.soft, same(mean.pair), mean.size};
    }
    return {hard_time, read.hard, read.soft, same(pair), 1};
  }
  /// The pair of a frame.
  PALPATE_INLINE static constexpr Pair pair(const Frame<Time, Real, Pair>& frame, Time, Time,
                                            const RangedReading<Real>&, bool) noexcept {
    return same(frame.pair);
  }

 private:
  /// Number by number: a copy of the whole waits in memory for the stores of its parts.
  template <class Given>
  PALPATE_INLINE static constexpr Pair same(const Given& pair) noexcept {
    return {pair.hard, pair.soft, pair.valid, pair.matched};
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
