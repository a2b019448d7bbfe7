// SPDX-License-Identifier: MIT
// Cost of each stage on readings that are seen once: ns for each reading and bytes of state. Prints JSON.

#include <cstdio>
#include <limits>
#include <memory>
#include <palpate/palpate.hpp>
#include <string>
#include <utility>
#include <vector>

#include "feeds.hpp"
#include "literal.hpp"
#include "timing.hpp"

namespace {

using Real = double;
using namespace palpate;

constexpr std::size_t chunk = 2000;

/// An estimator alone, on channels whose baselines are known, behind the interface of a tracker.
template <class Estimator>
struct Alone {
  struct {
    std::uint32_t samples = 0;
    Real seconds = 0;
  } settings;
  struct Ratio {
    Real ratio;
  };
  Estimator estimator;

  Ratio feed(std::int64_t, std::int64_t, Real hard, Real soft) {
    estimator.update(hard - 0.6, soft + 0.4);
    return {estimator.ratio()};
  }
  Real standard_error() const { return std::numeric_limits<Real>::quiet_NaN(); }
};

class Stages {
 public:
  template <class Subject>
  void add(const char* name, bool with_error = false, std::size_t bytes = sizeof(Subject)) {
    const auto feed = std::make_shared<Feed<Subject>>(readings_, chunk, with_error);
    bench_.add(name, static_cast<double>(chunk), [feed] { feed->work(); }, [feed] { feed->renew(); });
    bytes_.emplace_back(name, bytes);
  }
  template <class Estimator>
  void add_alone(const char* name) {
    add<Alone<Estimator>>(name, false, sizeof(Estimator));
  }

  void print(int rounds) {
    bench_.run(rounds);
    std::printf("{\n");
    bench_.print("");
    for (const auto& [name, bytes] : bytes_) {
      std::printf("  \"bytes, %s\": %zu%s\n", name.c_str(), bytes, name == bytes_.back().first ? "" : ",");
    }
    std::printf("}\n");
  }

 private:
  HeldReadings readings_{chunk * 201};
  Bench bench_;
  std::vector<std::pair<std::string, std::size_t>> bytes_;
};

template <int Order>
using Aligned = Align<Real, std::int64_t, Order>;
using Unaligned = NoAlign<Real, std::int64_t>;
using Matched = MatchedPair<Real, std::int64_t>;
using Base = Baseline<Real>;
using Gate = Contact<Real>;
using Hand = Handover<Real>;

}  // namespace

int main() {
  Stages stages;
  stages.add_alone<Literal>("the paper's form literally");
  stages.add_alone<FixedRls<Real>>("Rls");
  stages.add_alone<AdaptiveRls<Real>>("AdaptiveRls");
  stages.add_alone<Hand>("HandoverRls");
  stages.add<FixedTracker<Real>>("scene fixed");
  stages.add<PaperTracker<Real>>("scene paper");
  stages.add<HandheldTracker<Real>>("scene handheld");
  stages.add<HandheldTracker<Real>>("handheld, standard error after every reading", true);
  stages.add<Tracker<Real, Matched, Base, Gate, Hand>>("handheld without fit");
  stages.add<Tracker<Real, Unaligned, Base, Gate, Hand, Fit<Real>>>("handheld without align");
  stages.add<Tracker<Real, Aligned<4>, Base, Gate, Hand, Fit<Real>>>("handheld, align by 4 points");
  stages.add<Tracker<Real, Aligned<6>, Base, Gate, Hand, Fit<Real>>>("handheld, align by 6 points");
  stages.add<Tracker<Real, Matched, NoBaseline<Real>, AlwaysContact<Real>, Hand>>(
      "handheld without baseline, contact and fit");
  stages.add<Tracker<Real, Matched, Base, Gate, AdaptiveRls<Real>>>("handheld with AdaptiveRls, without fit");
  stages.print(100);
}
