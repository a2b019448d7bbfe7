// SPDX-License-Identifier: MIT
#pragma once

// The samples since the last change, in blocks that double in size with their age: which of them are read, which are cut.

#include <palpate/estimator/blocks.hpp>
#include <palpate/estimator/student.hpp>
#include <palpate/estimator/two_sided_cusum.hpp>
#include <palpate/square_root.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Variance of a ratio.
template <class Real>
struct RatioVariance {
  Real noise;               ///< of the noise, as the blocks scatter
  Real degrees_of_freedom;  ///< behind the noise
  Real moved;               ///< square of how far the ratio may have moved within the window
};

/// Windows over the newest samples, 32 of them to all since the last cut, with O(log n) numbers.
///
/// A level k has blocks of base * 2^k samples, of four the two oldest become one of the next level. The difference between
/// these two is what noise does at this scale, slow noise, too. A border between two blocks is tested when its level, or a coarser
/// one, gets a block: do all newer samples differ from all older ones? Where this is beyond doubt, the older ones are cut.
/// Before that a window is read and not deleted: the estimate is that of the longest window that agrees with all shorter
/// ones, by the intersection of their confidence intervals (Goldenshluger and Nemirovski 1997). An interval stays until its
/// level gets the next block; after a cut all are found anew.
template <class Real, int levels = 14>
class DyadicWindows {
  static_assert(is_real<Real>, "palpate::DyadicWindows: Real must be float or double");
  static_assert(2 <= levels && levels <= 24, "palpate::DyadicWindows: 2 to 24 levels");

 public:
  static constexpr int base = 4;          ///< samples of the smallest block
  static constexpr Real shortest = 8;     ///< smallest blocks in a window: the CUSUM is better at fewer samples
  static constexpr Real memory = 32;      ///< contrasts learned for each level: 25 % of the variance
  static constexpr Real kept = 16;        ///< of them after a cut: noise has no reason to change, but may
  static constexpr Real enough = 7;       ///< degrees of freedom before finer levels may join
  static constexpr Real fewest = 4;       ///< degrees of freedom for a test and a standard error
  static constexpr Real read_square = 3;  ///< square of the normal deviate of the intervals of the windows

  constexpr DyadicWindows() noexcept = default;
  /// With a ratio until the first sample.
  constexpr explicit DyadicWindows(Real ratio) noexcept : ratio_(ratio) {}
  /// A ratio until the next sample.
  constexpr void expect(Real ratio) noexcept { ratio_ = ratio; }

  /// Add a sample. Noise is learned from it if `learns`. Returns whether older samples were cut: their difference from the newer
  /// ones, in normal deviates, has a square above `cut_square`.
  PALPATE_INLINE constexpr bool add(const WeightedSample<Real>& sample, bool learns, Real cut_square) noexcept {
    const Real moment = product(sample.weight, sample.output - product(held_, sample.regressor));
    filling_ = filling_ + Block<Real>{moment, product(sample.weight, sample.regressor)};
    filled_ += 1;
    const bool cuts = filled_ >= base && filling_.information > 0 && complete(learns, cut_square);
    estimate();
    return cuts;
  }

  /// Only samples with this ratio and information are left. With the next one they are the first block.
  constexpr void restart(Real ratio, Real information) noexcept {
    const Real change = excited() ? ratio - ratio_ : Real(0);
    expect_motion(change, this->information() + information, information);
    held_ = ratio;
    for (Level& level : levels_) {
      level.drop(level.size());
      level.noise.shorten(kept);
    }
    sum_up(levels - 1);
    filling_ = {0, information};
    filled_ = base - 1;
    read_ = {};
    estimate();
  }

  /// Whether there is a ratio.
  constexpr bool excited() const noexcept { return information() > 0; }
  /// The ratio of the window that is read.
  constexpr Real ratio() const noexcept { return ratio_; }
  /// 1 / information(); 0 if not excited().
  constexpr Real covariance() const noexcept { return covariance_; }
  /// Information of the window that is read.
  constexpr Real information() const noexcept { return read_.information + filling_.information; }
  /// The ratio about which the sums are.
  constexpr Real held() const noexcept { return held_; }
  /// Samples since the last cut, of those that were added.
  constexpr Real samples() const noexcept {
    Real blocks = 0;
    for (int k = 0; k < levels; ++k) {
      blocks += product(levels_[k].count, size_of(k));
    }
    return product(Real(base), blocks) + filled_;
  }

  /// Whether the ratio may still move as it did at the last change.
  constexpr bool moves() const noexcept { return information() < moves_until_; }
  /// Variance of ratio(), by the blocks that are there and by what earlier ones have shown.
  constexpr RatioVariance<Real> variance() const noexcept {
    const PooledNoise<Real> pooled = noise_of_all();
    const Real moving = moves() ? product(slope_, information()) / 2 : Real(0);
    return {pooled.noise() / information(), pooled.degrees_of_freedom,
            product(moving, moving) + moved_square(pooled.noise())};
  }

  /// Whether a state that was not computed here can be one.
  constexpr bool possible() const noexcept {
    for (const Level& level : levels_) {
      if (!(level.count == 0 || level.count == 1 || level.count == 2 || level.count == 3)) {
        return false;
      }
    }
    return information() >= 0 && filled_ >= 0;
  }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (Level& level : levels_) {
      level.visit_state(visit);
    }
    visit_block(visit, filling_), visit_block(visit, read_);
    visit(held_), visit(ratio_), visit(covariance_), visit(filled_), visit(slope_), visit(moves_until_);
  }

 private:
  static constexpr Real unlimited = std::numeric_limits<Real>::max() / 4;

  template <class Visit>
  static constexpr void visit_block(Visit&& visit, Block<Real>& block) noexcept {
    visit(block.moment), visit(block.information);
  }

  /// An interval of ratios; nothing is known of those of the shortest windows.
  struct Interval {
    Real low = -unlimited, high = unlimited;
    /// What both have in common.
    constexpr Interval with(const Interval& other) const noexcept {
      return {low > other.low ? low : other.low, high < other.high ? high : other.high};
    }
    constexpr bool empty() const noexcept { return low > high; }
  };

  /// Blocks of one size, the oldest first.
  struct Level {
    Block<Real> blocks[4] = {};  // those that are not there are 0
    Real count = 0;
    NoiseOfBlocks<Real> noise;
    PooledNoise<Real> pooled;  // of this level and all coarser ones
    Block<Real> sum, older;    // of this level; of all coarser ones
    Interval intervals[3];     // of the ratios of the windows that end with each block, less held
    Interval common, agreed;   // of all of them; of this level and all coarser ones

    constexpr int size() const noexcept { return static_cast<int>(count); }
    constexpr Block<Real> oldest(int number) const noexcept {
      Block<Real> total;
      for (int j = 0; j < number; ++j) {
        total = total + blocks[j];
      }
      return total;
    }
    constexpr Block<Real> all() const noexcept { return blocks[0] + blocks[1] + blocks[2]; }
    /// Drop so many of the oldest.
    constexpr void drop(int oldest) noexcept {
      for (int j = 0; j < 4; ++j) {
        blocks[j] = j + oldest < 4 ? blocks[j + oldest] : Block<Real>();
      }
      count -= Real(oldest);
    }
    template <class Visit>
    constexpr void visit_state(Visit&& visit) noexcept {
      for (Block<Real>& block : blocks) {
        visit_block(visit, block);
      }
      visit(count), noise.visit_state(visit), visit(pooled.sum), visit(pooled.degrees_of_freedom);
      visit_block(visit, sum), visit_block(visit, older);
      for (Interval* interval : {&intervals[0], &intervals[1], &intervals[2], &common, &agreed}) {
        visit(interval->low), visit(interval->high);
      }
    }
  };

  /// Newest blocks that end with block `block` of a level.
  struct Border {
    int level = -1, block = 0;
    constexpr bool found() const noexcept { return level >= 0; }
  };

  /// Newest blocks, as they are added up from the newest on.
  struct Window {
    Block<Real> sum;
    Real offset = 0;   // of the sum
    Real scatter = 0;  // sum of the contrasts of each block with all newer ones
    Real blocks = 0, length = 0;

    constexpr void add(const Block<Real>& block, Real size) noexcept {
      scatter += blocks > 0 ? contrast(sum, offset, block).noise : Real(0);
      sum = sum + block;
      offset = sum.offset();
      blocks += 1;
      length += size;
    }
    /// The larger one of a noise and what three blocks and more show themselves.
    constexpr Real noise(Real learned) const noexcept {
      const Real own = blocks > 2 ? scatter / (blocks - 1) : Real(0);
      return own > learned ? own : learned;
    }
  };

  /// What the windows of a level are judged by.
  struct Limits {
    Real noise;               // variance of a ratio, times its information
    Real degrees_of_freedom;  // behind it; 0: it is not known
    Real read;                // square of the Student statistic of an interval
  };

  /// Smallest blocks in a block of a level.
  static constexpr Real size_of(int level) noexcept { return Real(1 << level); }

  PALPATE_INLINE constexpr void estimate() noexcept {
    if (PALPATE_LIKELY(excited())) {
      covariance_ = 1 / information();
      ratio_ = held_ + product(read_.moment + filling_.moment, covariance_);
    }
  }

  constexpr bool complete(bool learns, Real cut_square) noexcept {
    const int changed = push(filling_, learns);
    filling_ = {};
    filled_ = 0;
    if (levels_[changed].count == 1) {  // the first of its size
      hold(changed);
    }
    sum_up(changed);
    static_assert(shortest > 3, "palpate::DyadicWindows: the three blocks of the first level are no window");
    const Border border = changed > 0 ? judge(changed, cut_square) : Border();
    if (PALPATE_UNLIKELY(border.found())) {
      cut(border);
    }
    read(changed);
    return border.found();
  }

  /// Of four blocks of a size the two oldest become one of the next; returns the highest level that got a block.
  constexpr int push(Block<Real> block, bool learns) noexcept {
    for (int k = 0; k < levels; ++k) {
      Level& level = levels_[k];
      level.blocks[level.size()] = block;
      level.count += 1;
      if (level.count < 4) {
        return k;
      }
      if (learns) {
        level.noise.add(contrast(level.blocks[0], level.blocks[1]), memory);
      }
      block = level.oldest(2);
      level.drop(2);
    }
    return levels - 1;
  }

  /// Hold the mean ratio of all blocks: the sums are small, and nothing cancels.
  constexpr void hold(int highest) noexcept {
    Block<Real> all;
    for (int k = 0; k <= highest; ++k) {
      all = all + levels_[k].all();
    }
    shift(all.offset());
  }
  constexpr void shift(Real change) noexcept {
    held_ += change;
    for (Level& level : levels_) {
      for (Block<Real>& block : level.blocks) {
        block = block.shifted(change);
      }
    }
  }

  /// Sums of the levels up to `changed`.
  constexpr void sum_up(int changed) noexcept {
    for (int k = changed; k >= 0; --k) {
      Level& level = levels_[k];
      const bool coarsest = k + 1 == levels;
      level.sum = level.all();
      level.older = coarsest ? Block<Real>() : levels_[k + 1].older + levels_[k + 1].sum;
      level.pooled = (coarsest ? PooledNoise<Real>() : levels_[k + 1].pooled) + level.noise;
    }
  }

  /// Judge the windows of the levels up to `changed`; returns the newest border of a change.
  constexpr Border judge(int changed, Real cut_square) noexcept {
    Window newer;
    Border border;
    for (int k = 0; k <= changed; ++k) {
      Level& level = levels_[k];
      level.common = {};
      const bool judges = newer.length + product(level.count, size_of(k)) >= shortest;
      const Limits limits = judges ? limits_of(k) : Limits();
      for (int j = level.size() - 1; j >= 0; --j) {
        newer.add(level.blocks[j], size_of(k));
        level.intervals[j] = {};
        if (limits.degrees_of_freedom > 0 && newer.length >= shortest) {
          const bool differs = judge(newer, limits, level, j, cut_square);
          border = differs && !border.found() ? Border{k, j} : border;
        }
      }
    }
    return border;
  }

  /// Find the interval of a window; returns whether what is older differs from it.
  static constexpr bool judge(const Window& newer, const Limits& limits, Level& level, int j,
                              Real cut_square) noexcept {
    const Real noise = newer.noise(limits.noise);
    const Real half = square_root(product(noise, limits.read) / newer.sum.information);
    level.intervals[j] = {newer.offset - half, newer.offset + half};
    level.common = level.common.with(level.intervals[j]);
    const Block<Real> older = level.older + level.oldest(j);
    const Real difference = contrast(newer.sum, newer.offset, older).noise / noise;  // in units of its variance
    return difference > cut_square && difference > detail::student_square(cut_square, limits.degrees_of_freedom);
  }

  /// By the noise of this level and all coarser ones, and of the finer ones up to the first that differs.
  constexpr Limits limits_of(int k) const noexcept {
    PooledNoise<Real> pooled = levels_[k].pooled;
    for (int finer = k - 1; finer >= 0 && joins(pooled, levels_[finer].noise); --finer) {
      pooled = pooled + levels_[finer].noise;
    }
    const Real freedom = pooled.degrees_of_freedom;
    if (!(freedom >= fewest && pooled.sum > 0)) {
      return {};
    }
    return {pooled.noise(), freedom, detail::student_square(read_square, freedom)};
  }
  /// Whether the noise of a finer level joins that of coarser ones.
  static constexpr bool joins(const PooledNoise<Real>& coarser, const NoiseOfBlocks<Real>& finer) noexcept {
    return !(finer.count() > 0) || coarser.degrees_of_freedom < enough || coarser.agrees(finer);
  }

  /// Noise of the mean of all: with the contrast of each block that is there and all older ones.
  constexpr PooledNoise<Real> noise_of_all() const noexcept {
    PooledNoise<Real> pooled;
    Block<Real> older;
    for (int k = levels - 1; k >= 0; --k) {
      NoiseOfBlocks<Real> noise = levels_[k].noise;
      for (int j = 0; j < levels_[k].size(); ++j) {
        noise.add(contrast(older, levels_[k].blocks[j]), unlimited);
        older = older + levels_[k].blocks[j];
      }
      if (!joins(pooled, noise)) {
        break;
      }
      pooled = pooled + noise;
    }
    return pooled;
  }

  /// Square of how far the ratio may have moved within the window: of a straight line the newest half is half as far from the mean
  /// as its end is. Noise alone explains 1 of the contrast.
  constexpr Real moved_square(Real noise) const noexcept {
    const Block<Real> newest = newest_half();
    if (!(noise > 0 && newest.information < read_.information)) {
      return 0;
    }
    const Block<Real> rest{read_.moment - newest.moment, read_.information - newest.information};
    const Real excess = positive_part(contrast(newest, rest).noise - noise);
    return 4 * product(excess, 1 / newest.information - 1 / read_.information);
  }
  /// Of the window that is read: at least half of its information, and four blocks.
  constexpr Block<Real> newest_half() const noexcept {
    Block<Real> newest;
    int blocks = 0;
    for (int k = 0; k < levels; ++k) {
      for (int j = levels_[k].size() - 1; j >= 0; --j) {
        if (blocks >= 4 && 2 * newest.information >= read_.information) {
          return newest;
        }
        newest = newest + levels_[k].blocks[j];
        ++blocks;
      }
    }
    return newest;
  }

  /// Cut what is older than a border.
  constexpr void cut(const Border& border) noexcept {
    Level& last = levels_[border.level];
    const Block<Real> gone = last.older + last.oldest(border.block);
    last.drop(border.block);
    Block<Real> left;
    for (int k = 0; k < levels; ++k) {
      levels_[k].drop(k > border.level ? levels_[k].size() : 0);
      levels_[k].noise.shorten(kept);
      left = left + levels_[k].all();
    }
    expect_motion(left.offset() - gone.offset(), left.information + gone.information, left.information);
    shift(left.offset());
    sum_up(levels - 1);
    judge(border.level, unlimited);
  }

  /// After a change the ratio may still move as fast as it did, until the window, with the block that is filled, has four times
  /// the information that was left.
  constexpr void expect_motion(Real change, Real information, Real left) noexcept {
    slope_ = 2 * magnitude(change) / information;
    moves_until_ = 4 * left;
  }

  /// Read the longest window whose interval, and those of all shorter ones, have a ratio in common.
  constexpr void read(int changed) noexcept {
    for (int k = changed; k >= 0; --k) {
      const bool coarsest = k + 1 == levels || !(levels_[k + 1].count > 0);
      levels_[k].agreed = coarsest ? levels_[k].common : levels_[k + 1].agreed.with(levels_[k].common);
    }
    if (PALPATE_LIKELY(!levels_[0].agreed.empty())) {
      read_ = levels_[0].older + levels_[0].sum;
    } else {
      read_shorter();
    }
  }
  constexpr void read_shorter() noexcept {
    read_ = {};
    Interval common;
    for (const Level& level : levels_) {
      for (int j = level.size() - 1; j >= 0; --j) {
        common = common.with(level.intervals[j]);
        if (common.empty()) {
          return;
        }
        read_ = read_ + level.blocks[j];
      }
    }
  }

  Level levels_[levels] = {};
  Block<Real> filling_, read_;  // the block that is not complete; the sums of the window
  Real held_ = 0, filled_ = 0;
  Real ratio_ = 0, covariance_ = 0;
  Real slope_ = 0, moves_until_ = 0;  // of the last cut, per information; until there is so much
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
