// SPDX-License-Identifier: MIT
#pragma once

// What is judged of readings, beside the result of a touch: each judgement has a time, a channel, a name and a size.

#include <palpate/time.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Of which channel a judgement is.
enum class Channel : std::uint8_t { hard, soft, both };

/// What is judged.
enum class Judged : std::uint8_t {
  saturated,  ///< at the end of the range of its converter, or it does not follow the other channel
  frozen,     ///< it stands still to the last digit
  jumped,     ///< without contact, to a new level
  was_touch,  ///< what was taken for a jump of both channels
  step,       ///< within a touch
  falling,    ///< both channels, when pressed
  still,      ///< at its highest reading in several presses: saturated, or a stage stopped there
};

/// One judgement.
template <class Real, class Time>
struct Judgement {
  Judged what;         ///< its name
  Channel channel;     ///< of which channel
  Time time;           ///< of the first reading that it is about
  Real size;           ///< pF: where the channel stands, or by how much it changed; of both: of the hard channel
  Real soft_size = 0;  ///< pF: of both, of the soft channel
};

/// The judgements of one reading. More than `most` are not kept.
template <class Real, class Time>
class Judgements {
 public:
  static constexpr int most = 8;  ///< at a time
  /// Keep one more.
  constexpr void add(Judged what, Channel channel, Time time, Real size, Real soft_size = 0) noexcept {
    if (count_ < most) {
      all_[count_++] = {what, channel, time, size, soft_size};
    }
  }
  /// Forget all.
  constexpr void clear() noexcept { count_ = 0; }
  /// @{
  /// As of a container.
  constexpr const Judgement<Real, Time>* begin() const noexcept { return all_; }
  constexpr const Judgement<Real, Time>* end() const noexcept { return all_ + count_; }
  constexpr int size() const noexcept { return count_; }
  /// @}

 private:
  Judgement<Real, Time> all_[most]{};
  int count_ = 0;
};

/// The null version: nothing is judged.
struct NoJudgements {
  /// @{
  /// As of Judgements.
  static constexpr void clear() noexcept {}
  static constexpr const int* begin() noexcept { return nullptr; }
  static constexpr const int* end() noexcept { return nullptr; }
  static constexpr int size() noexcept { return 0; }
  /// @}
};

/// The judgements of a tracker, if it has a stage that judges.
template <class Real, class Time, bool judges>
struct KeptJudgements {
  Judgements<Real, Time> judgements_;  ///< of the last reading
};
/// The null version.
template <class Real, class Time>
struct KeptJudgements<Real, Time, false> {
  static constexpr NoJudgements judgements_{};  ///< none
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
