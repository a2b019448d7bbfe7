// SPDX-License-Identifier: MIT
#pragma once

// Many streams with new data in every repeat, and the triad over arrays of the same size.

#include <memory>
#include <palpate/handover_bank.hpp>
#include <vector>

#include "cache_lines.hpp"
#include "series.hpp"
#include "timing.hpp"

/// The memory of a bank's states.
template <class Core>
class BankStates {
 public:
  using Real = typename Core::real_type;

  explicit BankStates(std::size_t streams)
      : ratio_(streams), information_(streams), statistic_(streams), rejected_(streams) {}

  auto reset() {
    const Core core;
    std::fill(ratio_.begin(), ratio_.end(), core.ratio());
    std::fill(information_.begin(), information_.end(), core.information());
    std::fill(statistic_.begin(), statistic_.end(), Real(0));
    return
        typename palpate::Lanes<Core>::State{ratio_.data(), information_.data(), statistic_.data(), rejected_.data()};
  }

 private:
  LineVector<Real> ratio_, information_, statistic_;
  std::vector<std::uint64_t> rejected_;
};

template <class Real_, class Parameters>
class BankStates<palpate::Handover<Real_, Parameters>> {
 public:
  using Lanes = palpate::Lanes<palpate::Handover<Real_, Parameters>>;

  explicit BankStates(std::size_t streams)
      : streams_(streams), numbers_(Lanes::length(streams)), rejected_(Lanes::length(streams)) {}

  auto reset() {
    Lanes().reset(numbers_.data(), streams_);
    return typename Lanes::State{numbers_.data(), rejected_.data()};
  }

 private:
  std::size_t streams_;
  LineVector<Real_> numbers_;
  std::vector<std::uint64_t> rejected_;
};

/// `frames` samples of each stream, from new estimators; `chunks` of them, one after the other.
template <class Core>
class Streams {
 public:
  using Real = typename Core::real_type;

  Streams(std::size_t streams, std::size_t frames, std::size_t chunks)
      : streams_(streams),
        frames_(frames),
        cursor_(streams * frames, streams * frames * chunks),
        states_(streams),
        ratios_(streams * frames) {
    const Series data(streams * frames * chunks);
    output_.assign(data.output.begin(), data.output.end());
    regressor_.assign(data.regressor.begin(), data.regressor.end());
  }

  void work() {
    const auto at = cursor_.at();
    lanes_.process(states_.reset(), output_.data() + at, regressor_.data() + at, ratios_.data(), streams_, frames_);
  }
  void renew() { cursor_.renew(output_, regressor_); }
  double items() const { return static_cast<double>(streams_ * frames_); }

  void triad() {
    for (std::size_t i = 0; i < ratios_.size(); ++i) {
      ratios_[i] = output_[i] + Real(0.5) * regressor_[i];
    }
  }

 private:
  std::size_t streams_, frames_;
  Cursor cursor_;
  LineVector<Real> output_, regressor_;
  BankStates<Core> states_;
  LineVector<Real> ratios_;
  palpate::Lanes<Core> lanes_;
};

template <class Core>
void add_streams(Bench& bench, const char* name, std::size_t streams, std::size_t frames) {
  const auto s = std::make_shared<Streams<Core>>(streams, frames, 24);
  bench.add(name, s->items(), [s] { s->work(); }, [s] { s->renew(); });
}

/// A bank that no cache can hold, and a triad over its arrays.
template <class Core>
void add_large(Bench& bench, const std::string& name, std::size_t frames) {
  const auto s = std::make_shared<Streams<Core>>(65536, frames, 1);
  bench.add(name, s->items(), [s] { s->work(); });
  bench.add("triad over the arrays of the " + name, s->items(), [s] { s->triad(); });
}
