// SPDX-License-Identifier: MIT
#pragma once

// Many streams at once, each with its own Handover: the same bits as the same number of single estimators.

#include <palpate/bank.hpp>
#include <palpate/handover_pack.hpp>

namespace palpate {

/// Updates many estimators of type Handover, whose states are in the caller's memory. All have the settings of one.
///
/// The states are in groups, so that one sample of a pack needs few cache lines. HandoverPack updates them; at an alarm,
/// and at the sample after it, Handover itself does this for its stream.
template <class Real_, class Parameters>
class Lanes<Handover<Real_, Parameters>> {
 public:
  using Core = Handover<Real_, Parameters>;  ///< the estimator of one stream
  using real_type = Real_;                   ///< float or double
  using Real = Real_;                        ///< the same

  /// Streams of a group.
  static constexpr std::size_t group = group_size<Real>;

 private:
  using Pack = HandoverPack<Real, group>;
  using Value = palpate::Pack<Real>;
  static constexpr std::size_t width = sizeof(Value) / sizeof(Real);

 public:
  /// Numbers in the state of one stream.
  static constexpr std::size_t numbers = Pack::numbers;

  /// The states in the caller's memory.
  struct State {
    Real* numbers;            ///< length(streams) of them
    std::uint64_t* rejected;  ///< number of refused samples of each stream
  };

  /// Numbers in the states of so many streams. The last group is always whole.
  static constexpr std::size_t length(std::size_t streams) noexcept {
    return (streams + group - 1) / group * group * numbers;
  }

  /// With the settings of `core`.
  explicit Lanes(const Core& core = Core()) noexcept : core_(core), pack_(core.settings) {}

  /// The estimator of a stream.
  Core core(const Real* states, std::size_t stream) const noexcept {
    return with(core_, states + place(stream), group);
  }
  /// Set the estimator of a stream.
  static void set_core(Core core, Real* states, std::size_t stream) noexcept {
    Real* to = states + place(stream);
    core.visit_state([&to](const Real& number) {
      *to = number;
      to += group;
    });
  }
  /// Set all states to that of the core.
  void reset(Real* states, std::size_t streams) const noexcept {
    for (std::size_t i = 0; i < length(streams) / numbers; ++i) {
      set_core(core_, states, i);
    }
  }

  /// As Lanes::process of the other estimators.
  void process(const State& state, const Real* output, const Real* regressor, Real* ratios, std::size_t streams,
               std::size_t frames) const noexcept {
    for (std::size_t first = 0; first < streams; first += tile) {
      const std::size_t size = streams - first < tile ? streams - first : tile;
      for (std::size_t frame = 0; frame < frames; ++frame) {
        const std::size_t at = frame * streams + first;
        update({state.numbers + first * numbers, state.rejected + first}, output + at, regressor + at,
               ratios ? ratios + at : nullptr, size);
      }
    }
  }

  /// One sample of each stream.
  void update(const State state, const Real* output, const Real* regressor, Real* ratios,
              std::size_t streams) const noexcept {
    const Pack pack = pack_;  // a copy: as in Lanes::update of the other estimators
    const std::size_t whole = streams - streams % group;
    for (std::size_t i = 0; i < whole; i += group) {
      update_group(pack, {state.numbers + i * numbers, state.rejected + i}, output + i, regressor + i,
                   ratios ? ratios + i : nullptr);
    }
    if (whole < streams) {
      const State rest{state.numbers + whole * numbers, state.rejected + whole};
      update_rest(pack, rest, output + whole, regressor + whole, ratios ? ratios + whole : nullptr, streams - whole);
    }
  }

  /// Number of streams whose states stay in the first-level cache from frame to frame.
  static constexpr std::size_t tile = 8 * group;

 private:
  static constexpr std::size_t place(std::size_t stream) noexcept {
    return stream / group * group * numbers + stream % group;
  }

  static Core with(Core core, const Real* from, std::size_t stride) noexcept {
    core.visit_state([&from, stride](Real& number) {
      number = *from;
      from += stride;
    });
    return core;
  }

  void update_group(const Pack& pack, const State& state, const Real* output, const Real* regressor,
                    Real* ratios) const noexcept {
    for (std::size_t i = 0; i < group; i += width) {
      Value old[numbers];
      const auto exceptions = pack.update(state.numbers + i, output + i, regressor + i, old);
      if (PALPATE_UNLIKELY((exceptions.refused | exceptions.alarmed) != 0)) {
        except(exceptions, old, {state.numbers + i, state.rejected + i}, output + i, regressor + i);
      }
      if (ratios) {
        store(load<Value>(state.numbers + i), ratios + i);
      }
    }
  }

  PALPATE_COLD void except(const typename Pack::Exceptions exceptions, const Value* old, const State state,
                           const Real* output, const Real* regressor) const noexcept {
    Real before[numbers * width];
    for (std::size_t k = 0; exceptions.alarmed != 0 && k < numbers; ++k) {
      store(old[k], before + k * width);
    }
    for (std::size_t i = 0; i < width; ++i) {
      state.rejected[i] += exceptions.refused >> i & 1;
      if ((exceptions.alarmed >> i & 1) != 0) {
        Core core = with(core_, before + i, width);
        state.rejected[i] += !core.update(output[i], regressor[i]).accepted;
        set_core(core, state.numbers, i);
      }
    }
  }

  // A group that is not whole: its other streams take samples of 0.
  void update_rest(const Pack& pack, const State& state, const Real* output, const Real* regressor, Real* ratios,
                   std::size_t streams) const noexcept {
    Real y[group] = {}, x[group] = {}, new_ratios[group];
    std::uint64_t rejected[group] = {};
    for (std::size_t i = 0; i < streams; ++i) {
      y[i] = output[i];
      x[i] = regressor[i];
    }
    update_group(pack, {state.numbers, rejected}, y, x, new_ratios);
    for (std::size_t i = 0; i < streams; ++i) {
      state.rejected[i] += rejected[i];
      if (ratios) {
        ratios[i] = new_ratios[i];
      }
    }
  }

  Core core_;
  Pack pack_;
};

/// `Streams` estimators of type Handover, with their memory.
template <class Real_, class Parameters, std::size_t Streams>
class Bank<Handover<Real_, Parameters>, Streams> {
  static_assert(Streams > 0, "palpate::Bank: Streams must be 1 or more");

 public:
  using Core = Handover<Real_, Parameters>;  ///< the estimator of one stream
  using real_type = Real_;                   ///< float or double
  using Real = Real_;                        ///< the same

  /// All streams as `core`.
  explicit Bank(const Core& core = Core()) noexcept : lanes_(core) { lanes_.reset(numbers_, Streams); }

  /// One sample of each stream; `ratios`, if not null, receives the new ratios.
  void update(const Real* output, const Real* regressor, Real* ratios = nullptr) noexcept {
    lanes_.update({numbers_, rejected_}, output, regressor, ratios, Streams);
  }

  /// Number of streams.
  static constexpr std::size_t size() noexcept { return Streams; }
  /// The estimator of a stream: a copy.
  Core core(std::size_t stream) const noexcept { return lanes_.core(numbers_, stream); }
  /// @{
  /// As the function of the estimator of this name, for one stream, 0 to Streams - 1.
  Real ratio(std::size_t stream) const noexcept { return core(stream).ratio(); }
  Real information(std::size_t stream) const noexcept { return core(stream).information(); }
  Real covariance(std::size_t stream) const noexcept { return core(stream).covariance(); }
  Real statistic(std::size_t stream) const noexcept { return core(stream).statistic(); }
  bool alarm(std::size_t stream) const noexcept { return core(stream).alarm(); }
  /// @}
  /// Number of refused samples of a stream.
  std::uint64_t rejected(std::size_t stream) const noexcept { return rejected_[stream]; }

 private:
  Lanes<Core> lanes_;
  alignas(64) Real numbers_[Lanes<Core>::length(Streams)];
  std::uint64_t rejected_[Streams] = {};
};

}  // namespace palpate
