// SPDX-License-Identifier: MIT
#pragma once

// Noise that is slower than the readings: breathing, 1/f noise, a walk. A mean over many readings does not remove it.

#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// The slow noise of the idle readings of a channel, from differences between the means of neighbouring blocks. Blocks have
/// 8 to 256 values. A block of a lower level is a mean without its largest and its smallest value, so that a spike is none. The mean
/// of the differences is a drift, and no noise.
template <class Real>
class SlowNoise {
  static constexpr int smallest = 8, levels = 6;
  static constexpr std::uint8_t first = 16, fewest = 4,
                                most = 255;  // differences: of the smallest blocks; of larger ones

 public:
  /// Add an idle value. `suspected`: a touch may have begun, so that no block ends.
  constexpr void add(Real value, bool suspected) noexcept {
    highest_ = size_ > 0 && value < highest_ ? highest_ : value;
    lowest_ = size_ > 0 && value > lowest_ ? lowest_ : value;
    origin_ = size_ > 0 ? origin_ : value;
    sum_ += value - origin_;
    size_ += 1;
    if (!suspected && size_ >= smallest) {
      end_block();
    }
  }

  /// A touch has begun: the last values may belong to it, and the next block is no neighbour.
  constexpr void interrupt() noexcept {
    size_ = sum_ = 0;
    waits_ = false;
    for (Level& level : levels_) {
      level.blocks = 0;
    }
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
        return found;
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
      last = block;
      blocks = blocks == 1 ? 2 : blocks == 2 ? 1 : 0;
      if (blocks == 0) {
        blocks = 1;
        return false;
      }
      // Welford's update; the oldest differences count less, at last.
      count = static_cast<std::uint8_t>(count + (count < most));
      const Real n = count, off = change - mean;
      mean += off / n;
      variance += (product(off, change - mean) - variance) / n;
      return blocks == 2;
    }
  };

  constexpr void end_block() noexcept {
    Real block = waiting_;
    waiting_ = origin_ + (sum_ - (highest_ - origin_) - (lowest_ - origin_)) / (size_ - 2);
    size_ = sum_ = 0;
    const bool waited = waits_;
    waits_ = true;
    for (int k = 0; waited && k < levels; ++k) {
      const Real before = levels_[k].last;
      if (!levels_[k].add(block)) {
        return;
      }
      block = (before + block) / 2;
    }
  }

  Level levels_[levels] = {};
  Real origin_ = 0, sum_ = 0, size_ = 0, highest_ = 0, lowest_ = 0;  // of the values of a block
  Real waiting_ = 0;                                                 // the last block, until the next one ends
  bool waits_ = false;
};

/// The slow noise of both channels.
template <class Real>
class SlowNoises {
 public:
  Real hard = 0;  ///< variance of the hard channel in the last touch
  Real soft = 0;  ///< of the soft channel

  /// As the function of SlowNoise of this name.
  constexpr void add(Real hard_value, Real soft_value, bool suspected) noexcept {
    of_hard_.add(hard_value, suspected);
    of_soft_.add(soft_value, suspected);
  }
  /// As the function of SlowNoise of this name.
  constexpr void interrupt() noexcept {
    of_hard_.interrupt();
    of_soft_.interrupt();
  }
  /// Finds the variances of a touch with so many samples.
  template <class Errors>
  constexpr void find(const Errors& errors) noexcept {
    const auto samples = static_cast<Real>(errors.samples);
    hard = variance(of_hard_, errors.hard, samples);
    soft = variance(of_soft_, errors.soft, samples);
  }

 private:
  // The variance of the difference between the mean of a touch and that of a baseline. For means of equal lengths it is twice that of
  // one; with a walk or with stationary noise it is their sum, also if the lengths differ.
  template <class Baseline>
  static constexpr Real variance(const SlowNoise<Real>& noise, const Baseline& baseline, Real samples) noexcept {
    const Real white = product(baseline.noise(), baseline.noise());
    return noise.of_mean(samples, white) + noise.of_mean(white / baseline.variance(), white);
  }

  SlowNoise<Real> of_hard_, of_soft_;
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
