// SPDX-License-Identifier: MIT
#pragma once

// Scale and autocorrelation of the innovations, learned from those that no detector suspects.

#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {
namespace detail {

/// base^n for a whole n.
template <class Real>
constexpr Real power(Real base, int n) noexcept {
  Real result = 1;
  for (; n > 0; n /= 2) {
    result = n % 2 == 1 ? product(result, base) : result;
    base = product(base, base);
  }
  return result;
}

}  // namespace detail

/// Noise of the innovations e(k): the scale of the whitened ones, e(k) - rho e(k-1), and rho.
///
/// While a side of the CUSUM is up, the innovations may be a change that begins, and a noise that learned it would hide it: what they
/// show waits, is learned when both sides are down again, by its mean, and is forgotten at a change. But what has both signs is no change of the
/// ratio: that part of their magnitudes counts at once.
template <class Real>
class UnsuspectedNoise {
 public:
  static constexpr Real memory = Real(0.995);  ///< forgetting factor of the autocorrelation
  static constexpr Real share = Real(0.02);    ///< of a new magnitude: a memory of about 100
  static constexpr Real fewest =
      32;  ///< so few cannot show a correlation over more samples; then rho is estimated after every 8th
  static constexpr int patience = 128;  ///< samples that wait at most
  static constexpr Real trust = 10;     ///< samples that the scale counts as, beside those that wait

  /// Without a sample.
  constexpr UnsuspectedNoise() noexcept {}

  /// The innovation minus its forecast.
  constexpr Real whitened(Real innovation) const noexcept { return innovation - product(rho_, before_); }
  /// The innovation of a whitened one.
  constexpr Real of_whitened(Real whitened) const noexcept { return product(rho_, before_) + whitened; }

  /// Standard deviation of the whitened innovations: for a normal distribution sqrt(pi / 2) times the mean magnitude.
  constexpr Real scale() const noexcept {
    Real mean = mean_magnitude_;
    if (PALPATE_UNLIKELY(waiting_ > 0)) {
      const Real less = rises_ < falls_ ? rises_ : falls_;
      const Real both = (2 * less + product(trust, mean)) / (waiting_ + trust);
      mean = both > mean ? both : mean;
    }
    return product(Real(1.2533141), mean);
  }

  /// Add the n-th whitened innovation, limited, of a rise of the ratio or not, and the innovation itself, unless it is an outlier. It
  /// waits while a change is suspected.
  PALPATE_INLINE constexpr void add(Real limited, Real innovation, bool rise, bool outlier, bool suspected,
                                    Real n) noexcept {
    if (PALPATE_LIKELY(!suspected && waiting_ == 0)) {
      mean_magnitude_ += product(mean_share(n, share), magnitude(limited) - mean_magnitude_);
      add_pair(lag0_, lag1_, count_, innovation, outlier);
    } else {
      waiting_ += 1;
      (rise ? rises_ : falls_) += magnitude(limited);
      add_pair(lag0_waiting_, lag1_waiting_, pairs_waiting_, innovation, outlier);
      if (!suspected || waiting_ >= patience) {
        learn_waiting(n);
      }
    }
    until_forecast_ -= 1;
    if (PALPATE_UNLIKELY(!(until_forecast_ > 0))) {
      until_forecast_ = n < fewest ? Real(1) : Real(8);
      forecast_anew();
    }
  }
  /// What waits was noise, after n innovations.
  constexpr void accept(Real n) noexcept {
    if (waiting_ > 0) {
      learn_waiting(n);
    }
  }
  /// What waits was a change.
  constexpr void forget_waiting() noexcept {
    waiting_ = rises_ = falls_ = lag0_waiting_ = lag1_waiting_ = pairs_waiting_ = 0;
  }
  /// The next innovation is forecast from this one.
  constexpr void remember(Real innovation) noexcept { before_ = innovation; }

  /// Samples that wait: about as many as since a change began, if there is one.
  constexpr Real waiting() const noexcept { return waiting_; }
  /// Variance of the innovations.
  constexpr Real variance() const noexcept { return count_ > 0 ? lag0_ / count_ : Real(0); }

  /// Whether a state that was not computed here can be one.
  constexpr bool possible() const noexcept { return 0 <= waiting_ && waiting_ <= patience; }

  /// As Rls::visit_state.
  template <class Visit>
  constexpr void visit_state(Visit&& visit) noexcept {
    for (Real* number : {&mean_magnitude_, &lag0_, &lag1_, &count_, &rho_, &before_, &until_forecast_, &waiting_,
                         &rises_, &falls_, &lag0_waiting_, &lag1_waiting_, &pairs_waiting_}) {
      visit(*number);
    }
  }

 private:
  PALPATE_INLINE constexpr void add_pair(Real& lag0, Real& lag1, Real& count, Real innovation,
                                         bool outlier) const noexcept {
    if (PALPATE_LIKELY(!outlier)) {
      lag0 = product(memory, lag0) + product(innovation, innovation);
      lag1 = product(memory, lag1) + product(innovation, before_);
      count = product(memory, count) + 1;
    }
  }
  constexpr void learn_waiting(Real n) noexcept {
    const Real older = n > waiting_ ? detail::power(1 - mean_share(n, share), static_cast<int>(waiting_)) : Real(0);
    mean_magnitude_ += product(1 - older, (rises_ + falls_) / waiting_ - mean_magnitude_);
    const Real left = 1 - product(1 - memory, pairs_waiting_);  // memory to the power of the pairs
    lag0_ = product(left, lag0_) + lag0_waiting_;
    lag1_ = product(left, lag1_) + lag1_waiting_;
    count_ = product(left, count_) + pairs_waiting_;
    forget_waiting();
  }

  constexpr void forecast_anew() noexcept {
    lag0_ = normal_or_0(lag0_);
    lag1_ = normal_or_0(lag1_);
    mean_magnitude_ = normal_or_0(mean_magnitude_);
    rho_ = lag0_ > 0 ? corrected(lag1_ / lag0_) : Real(0);
  }

  // Kendall's bias of a correlation, -(1 + 3 r) / n (Biometrika 41, 1954).
  constexpr Real corrected(Real correlation) const noexcept {
    constexpr Real most = (fewest - 1) / (fewest + 1);
    const Real value = correlation + (1 + product(Real(3), correlation)) / count_;
    return value > most ? most : value < -most ? -most : value;
  }

  Real mean_magnitude_ = 0, lag0_ = 0, lag1_ = 0, count_ = 0, rho_ = 0, before_ = 0, until_forecast_ = 0;
  Real waiting_ = 0, rises_ = 0, falls_ = 0;  // samples that wait, and their magnitudes by sign
  Real lag0_waiting_ = 0, lag1_waiting_ = 0;
  Real pairs_waiting_ = 0;  // 1 + memory + memory^2 + ...: so (1 - memory^n) / (1 - memory)
};

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
