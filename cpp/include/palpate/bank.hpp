// SPDX-License-Identifier: MIT
#pragma once

// Many streams at once, each with its own Rls: the same bits as the same number of single estimators.

#include <cstdint>
#include <limits>
#include <palpate/estimator/rls.hpp>
#include <palpate/pack.hpp>

namespace palpate {

/// Updates many estimators of type Core. Their states, with the number of refused samples of each, are a structure of
/// arrays in the caller's memory. All have the parameters of one Core.
///
/// Packs of streams use the same operations as one stream in Rls, with selects in place of its branches. A pack with a
/// sample that Rls would refuse is computed again, stream by stream.
template <class Core>
class Lanes {
  static_assert(std::is_same_v<typename Core::check_type, Checked>,
                "palpate::Bank: its estimators must be Checked, as a bank refuses what is not finite");

 public:
  using real_type = typename Core::real_type;  ///< float or double
  using Real = real_type;                      ///< the same

  /// The states in the caller's memory: one number of each stream in each array.
  struct State {
    Real* ratio;              ///< r
    Real* information;        ///< R = 1 / P
    Real* signed_statistic;   ///< g, negative during an alarm: see policy/detector.hpp
    std::uint64_t* rejected;  ///< number of refused samples

    /// Those from this stream on.
    State from(std::size_t stream) const noexcept {
      return {ratio + stream, information + stream, signed_statistic + stream, rejected + stream};
    }
  };

  /// With the policies of `core`.
  constexpr explicit Lanes(const Core& core = Core()) noexcept
      : steady_(core.forgetting().factor(false)),
        alarmed_(core.forgetting().factor(true)),
        detector_(core.detector()),
        bound_(core.bound()) {}

  /// `frames` samples of each stream: sample k of stream s is at [k * streams + s], and so is its ratio. `ratios` may
  /// be null, or the same array as `output` or `regressor`.
  void process(const State& state, const Real* output, const Real* regressor, Real* ratios, std::size_t streams,
               std::size_t frames) const noexcept {
    for (std::size_t first = 0; first < streams; first += tile) {
      const std::size_t size = streams - first < tile ? streams - first : tile;
      for (std::size_t frame = 0; frame < frames; ++frame) {
        const std::size_t at = frame * streams + first;
        update(state.from(first), output + at, regressor + at, ratios ? ratios + at : nullptr, size);
      }
    }
  }

  /// One sample of each stream.
  void update(const State state, const Real* output, const Real* regressor, Real* ratios,
              std::size_t streams) const noexcept {
    const Lanes lanes = *this;  // a copy: otherwise the compiler must assume that a store changes a parameter
    constexpr std::size_t width = sizeof(Pack<Real>) / sizeof(Real);
    const std::size_t whole = streams - streams % (2 * width);
    for (std::size_t i = 0; i < whole; i += 2 * width) {
      const auto first = lanes.template next<Pack<Real>>(state, output, regressor, i);
      const auto second = lanes.template next<Pack<Real>>(state, output, regressor, i + width);
      // If the sum overflows, the streams are checked one by one. The ratios are added last, since they are ready last.
      const auto sum = first.known_early() + second.known_early() + first.ratio + second.ratio;
      if (PALPATE_UNLIKELY(
              !holds_everywhere<Real>(magnitude(sum) <= Pack<Real>{} + std::numeric_limits<Real>::max()))) {
        lanes.one_by_one(state, output, regressor, ratios, i, i + 2 * width);
        continue;
      }
      first.store_to(state, ratios, i);
      second.store_to(state, ratios, i + width);
    }
    lanes.one_by_one(state, output, regressor, ratios, whole, streams);
  }

  /// Number of streams whose state stays in the second-level cache from frame to frame.
  static constexpr std::size_t tile = 1024;

 private:
  template <class Value>
  struct Next {
    Value ratio, information, signed_statistic;

    Value known_early() const noexcept { return information + signed_statistic; }
    void store_to(const State& state, Real* ratios, std::size_t i) const noexcept {
      store(ratio, state.ratio + i);
      store(information, state.information + i);
      store(signed_statistic, state.signed_statistic + i);
      if (ratios) {
        store(ratio, ratios + i);
      }
    }
  };

  template <class Value>
  Next<Value> next(const State& state, const Real* output, const Real* regressor, std::size_t i) const noexcept {
    const auto x = load<Value>(regressor + i), ratio = load<Value>(state.ratio + i);
    const Value innovation = load<Value>(output + i) - product(x, ratio);
    const auto before = load<Value>(state.signed_statistic + i);
    const Value statistic = detector_.next(magnitude(before), innovation);
    const auto alarm = detector_.alarm(statistic, before < Value{});
    const Value forgetting = select(alarm, Value{} + alarmed_, Value{} + steady_);
    const Value discounted = product(forgetting, load<Value>(state.information + i));
    const Value information = bound_.limit(discounted) + product(x, x);
    return {ratio + product(x / information, innovation), information, select(alarm, -statistic, statistic)};
  }

  void one_by_one(const State& state, const Real* output, const Real* regressor, Real* ratios, std::size_t i,
                  std::size_t end) const noexcept {
    for (; i < end; ++i) {
      const auto after = next<Real>(state, output, regressor, i);
      if (is_finite(after.ratio) && is_finite(after.information) && is_finite(after.signed_statistic)) {
        after.store_to(state, ratios, i);
      } else {
        ++state.rejected[i];
        if (ratios) {
          ratios[i] = state.ratio[i];
        }
      }
    }
  }

  Real steady_, alarmed_;
  std::decay_t<decltype(std::declval<Core>().detector())> detector_;
  std::decay_t<decltype(std::declval<Core>().bound())> bound_;
};

/// `Streams` estimators of type Core, an Rls with any policies that is Checked, with their memory.
template <class Core, std::size_t Streams>
class Bank {
  static_assert(Streams > 0, "palpate::Bank: Streams must be 1 or more");

 public:
  using real_type = typename Core::real_type;  ///< float or double
  using Real = real_type;                      ///< the same

  /// All streams as `core`: its policies, its ratio and its information.
  explicit Bank(const Core& core = Core()) noexcept : lanes_(core) {
    for (std::size_t i = 0; i < Streams; ++i) {
      ratio_[i] = core.ratio();
      information_[i] = core.information();
    }
  }

  /// One sample of each stream; `ratios`, if not null, receives the new ratios.
  void update(const Real* output, const Real* regressor, Real* ratios = nullptr) noexcept {
    lanes_.update({ratio_, information_, signed_statistic_, rejected_}, output, regressor, ratios, Streams);
  }

  /// Number of streams.
  static constexpr std::size_t size() noexcept { return Streams; }
  /// @{
  /// As the function of the estimator of this name, for one stream, 0 to Streams - 1.
  Real ratio(std::size_t stream) const noexcept { return ratio_[stream]; }
  Real information(std::size_t stream) const noexcept { return information_[stream]; }
  Real covariance(std::size_t stream) const noexcept { return Real(1) / information_[stream]; }
  Real statistic(std::size_t stream) const noexcept { return magnitude(signed_statistic_[stream]); }
  bool alarm(std::size_t stream) const noexcept { return signed_statistic_[stream] < 0; }
  /// @}
  /// Number of refused samples of a stream.
  std::uint64_t rejected(std::size_t stream) const noexcept { return rejected_[stream]; }

 private:
  Lanes<Core> lanes_;
  // Access to a pack that crosses two cache lines takes twice as long.
  alignas(64) Real ratio_[Streams];
  alignas(64) Real information_[Streams];
  alignas(64) Real signed_statistic_[Streams] = {};
  std::uint64_t rejected_[Streams] = {};
};

}  // namespace palpate
