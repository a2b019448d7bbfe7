// SPDX-License-Identifier: MIT
#pragma once

// Noise that is slower than the readings: breathing, 1/f noise, a walk. A mean over many readings does not remove it.

#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The slow noise of the idle readings of a channel, from differences between the means of neighbouring blocks of 8 to 256 values.
/// The mean of the differences is a drift, and no noise. Each block of 8 is a mean without its largest and its smallest value: a spike
/// changes nothing.
template <class Real>
class SlowNoise {
  static constexpr Real off_limit = Real(4);  // of a difference, standard deviations
  static constexpr int smallest = 8, levels = 6;
  static constexpr std::uint8_t first = 16, fewest = 4,
                                most = 255;  // differences: of the smallest blocks; of larger ones

 public:
  Real variance = 0;  ///< of the difference between the mean of a touch and its baseline

  /// Add an idle value. `suspected`: a touch may have begun, so that no block ends.
  constexpr void add(Real value, bool suspected) noexcept {
    if (size_ == 0) {
      origin_ = value;
      sum_ = highest_ = lowest_ = 0;
    }
    const Real off = value - origin_;
    sum_ += off;
    highest_ = off > highest_ ? off : highest_;
    lowest_ = off < lowest_ ? off : lowest_;
    size_ += 1;
    if (!suspected && size_ >= smallest) {
      end_block();
    }
  }

  /// A touch has begun, perhaps in the last values; the next block is no neighbour.
  constexpr void interrupt() noexcept {
    size_ = 0;
    for (Level& level : levels_) {
      level.blocks = 0;
    }
  }

  /// Computes the variance of the difference between the mean of a touch and its baseline: the sum of the variances of both means.
  /// For a walk, and for stationary noise, this holds for any two lengths.
  template <class Baseline>
  constexpr void find(const Baseline& baseline, std::uint32_t samples) noexcept {
    const Real white = product(baseline.noise(), baseline.noise()), of_level = baseline.variance();
    variance = of_mean(static_cast<Real>(samples), white);
    variance += of_level > 0 ? of_mean(white / of_level, white) : Real(0);  // a given level has no error
  }

  /// Variance of a mean over so many values, beyond the noise of single values with the variance `white`: from the smallest blocks
  /// that are as long; if these are not known, from shorter ones, in proportion as of a walk. Of the noise of single values 3 of its
  /// standard errors, sqrt(2 / n), are taken away, too: with white noise nothing is left.
  constexpr Real of_mean(Real length, Real white) const noexcept {
    Real found = 0, size = smallest;
    std::uint8_t least = first;
    for (const Level& level : levels_) {
      if (level.count < least) {
        break;
      }
      least = fewest;
      const Real n = level.count, of_white = product(white / size, 1 + 4 / square_root(n));
      found = positive_part(product(level.variance, n / (n - 1)) / 2 - of_white);
      if (!(size < length)) {
        break;
      }
      found = product(found, length / size);
      size *= 2;
    }
    return found;
  }

 private:
  struct Level {
    Real last = 0, mean = 0, variance = 0;  // the last block; of the differences
    std::uint8_t count = 0, blocks = 0;     // differences; 1: the last block waits for its neighbour, 2: it had one

    // Returns whether both blocks make a larger one.
    constexpr bool add(Real block) noexcept {
      const Real change = block - last;
      const bool known = blocks > 0;
      last = block;
      blocks = blocks == 1 ? 2 : 1;
      if (known) {  // Welford's update; in the end the oldest differences count less
        count = static_cast<std::uint8_t>(count + (count < most));
        const Real n = count, most_off = product(off_limit, square_root(variance)), seen = change - mean;
        const Real off = count <= fewest ? seen : seen > most_off ? most_off : seen < -most_off ? -most_off : seen;
        mean += off / n;
        variance += (product(off, off - off / n) - variance) / n;
      }
      return blocks == 2;
    }
  };

  constexpr void end_block() noexcept {
    Real block = origin_ + (sum_ - highest_ - lowest_) / (size_ - 2);
    size_ = 0;
    for (Level& level : levels_) {
      const Real before = level.last;
      if (!level.add(block)) {
        break;
      }
      block = (before + block) / 2;
    }
  }

  Level levels_[levels] = {};
  Real origin_ = 0, sum_ = 0, size_ = 0, highest_ = 0, lowest_ = 0;  // of the values of a block; from the first one
};

/// The slow noise of both channels.
template <class Real>
struct SlowNoises {
  SlowNoise<Real> hard, soft;

  /// Finds the variances of a touch.
  template <class Errors>
  constexpr void find(const Errors& errors) noexcept {
    hard.find(errors.hard, errors.samples);
    soft.find(errors.soft, errors.samples);
  }
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
