// SPDX-License-Identifier: MIT
// libFuzzer: arbitrary readings at arbitrary times through every scene and estimator, in both types. Whatever comes,
// the state stays finite, counts add up, and nothing is undefined (AddressSanitizer and UBSan watch).

#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <palpate/palpate.hpp>

namespace {

void require(bool ok, const char* what) {
  if (!ok) {
    std::fprintf(stderr, "%s\n", what);
    std::abort();
  }
}

class Bytes {
 public:
  Bytes(const std::uint8_t* data, std::size_t size) : data_(data), size_(size) {}
  bool empty() const { return size_ == 0; }

  template <class T>
  T take() {
    T value{};
    const std::size_t count = size_ < sizeof(T) ? size_ : sizeof(T);
    std::memcpy(&value, data_, count);
    data_ += count;
    size_ -= count;
    return value;
  }

  /// A value as a probe gives it, or any bits at all.
  template <class Real>
  Real value(Real before) {
    const auto kind = take<std::uint8_t>();
    if (kind < 200) {
      return before + static_cast<Real>(static_cast<std::int8_t>(kind)) * Real(0.004);
    }
    return kind < 240 ? static_cast<Real>(take<std::int16_t>()) / 4096 : take<Real>();
  }

  template <class Time>
  Time time(Time before) {
    const auto kind = take<std::uint8_t>();
    return kind < 220 ? before.later(kind * 100) : Time(take<decltype(Time::count)>());
  }

 private:
  const std::uint8_t* data_;
  std::size_t size_;
};

template <class Scene>
void run_scene(Bytes bytes) {
  Scene scene;
  const auto samples = bytes.take<std::uint8_t>();
  if constexpr (!std::is_const_v<std::remove_reference_t<decltype(scene.settings)>>) {
    scene.settings.samples = samples;
  }
  using Real = typename Scene::real_type;
  typename Scene::time_type t_hard, t_soft;
  Real hard = 0, soft = 0;
  std::uint32_t flags = 0, saturated = 0;  // of the last touch
  while (!bytes.empty()) {
    t_hard = bytes.time(t_hard);
    t_soft = bytes.time(t_soft);
    hard = bytes.value(hard);
    soft = bytes.value(soft);
    const auto report = scene.feed(t_hard, t_soft, hard, soft);
    require(palpate::is_finite(report.ratio), "the ratio is not finite");
    if (report.finished) {
      const auto touch = scene.touch();
      const bool known = palpate::is_finite(touch.ratio) && touch.covariance > 0;
      require(touch.samples > 0 ? known : touch.ratio != touch.ratio, "a touch without a ratio");
      require(!(touch.standard_error < 0), "a negative standard error");
    }
    if (report.revised) {
      const auto touch = scene.touch();
      require(palpate::is_finite(touch.first_ratio) || touch.samples == 0, "a revised touch without a first ratio");
      // A jump of a channel changes the flags, and one that stands still is saturated: without a new baseline.
      const bool judged = touch.misfits.flags != flags || touch.saturated != saturated;
      require(touch.revision != palpate::Revision::none || judged, "a revised touch without a revision");
    }
    if (report.finished || report.revised) {
      flags = scene.touch().misfits.flags;
      saturated = scene.touch().saturated;
    }
    if (!palpate::is_finite(hard) || !palpate::is_finite(soft)) {
      hard = soft = 0;
    }
  }
}

template <class Real, class Time>
void run_stamps(Bytes bytes) {
  palpate::SteadyStamps<Real, Time> stamps;
  Time time;
  while (!bytes.empty()) {
    time = bytes.time(time);
    stamps.smooth(time);
  }
}

template <class Estimator>
void run_estimator(Bytes bytes, bool begins_empty = false) {
  using Real = typename Estimator::real_type;
  Estimator estimator;
  while (!bytes.empty()) {
    const Real output = bytes.value(Real(0.5)), regressor = bytes.value(Real(0.25)), before = estimator.ratio();
    const auto step = estimator.update(output, regressor);
    require(palpate::is_finite(estimator.ratio()) && (estimator.information() > 0 || begins_empty),
            "the state is not finite");
    require(palpate::is_finite(estimator.information()), "the information is not finite");
    require(estimator.statistic() >= 0, "a negative statistic");
    require(step.accepted || estimator.ratio() == before, "a refused sample changed the ratio");
    require(!step.accepted || (palpate::is_finite(output) && palpate::is_finite(regressor)), "took what is not finite");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const Bytes bytes(data, size);
  run_scene<palpate::HandheldTracker<double>>(bytes);
  run_scene<palpate::HandheldTracker<float, palpate::Microseconds>>(bytes);
  run_scene<palpate::embedded::HandheldTracker<float>>(bytes);
  run_scene<palpate::PaperTracker<float, palpate::Microseconds>>(bytes);
  run_scene<palpate::FixedTracker<double>>(bytes);
  run_stamps<double, palpate::Nanoseconds>(bytes);
  run_stamps<float, palpate::Microseconds>(bytes);
  run_estimator<palpate::AdaptiveRls<double>>(bytes);
  run_estimator<palpate::AdaptiveRls<float>>(bytes);
  run_estimator<palpate::Handover<double>>(bytes);
  run_estimator<palpate::Handover<float>>(bytes);
  run_estimator<palpate::AdaptiveWindow<double>>(bytes, true);
  run_estimator<palpate::AdaptiveWindow<float>>(bytes, true);
  return 0;
}
