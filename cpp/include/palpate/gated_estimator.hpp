// SPDX-License-Identifier: MIT
#pragma once

// Touches for a loop that has its baseline already: the gate, and an estimator for so many samples from contact.

#include <palpate/tracker.hpp>

namespace palpate {

template <class Estimator>
struct GatedSettings {
  using Real = typename Estimator::real_type;
  Real noise = Real(1e-4);      // standard deviation of the sum of the two changes, pF
  Real full_scale = Real(1e9);  // changes whose sum is of this size, or not finite, are refused
  Real initial_ratio = Real(1), initial_covariance = Estimator::default_covariance;
  std::uint32_t samples = 250;  // of a touch

  template <class Visit>
  static constexpr void visit_fields(Visit&& visit) noexcept {
    visit("noise", &GatedSettings::noise);
    visit("full_scale", &GatedSettings::full_scale);
    visit("initial_ratio", &GatedSettings::initial_ratio);
    visit("initial_covariance", &GatedSettings::initial_covariance);
    visit("samples", &GatedSettings::samples);
  }
};

/// What Tracker does, without its stages before the gate and without its counts.
template <class ContactStage, class Estimator, class Settings = Kept<GatedSettings<Estimator>>>
class GatedEstimator : public Settings {
 public:
  using real_type = typename Estimator::real_type;
  using Real = real_type;
  using Settings::settings;

  ContactStage gate;
  Estimator estimator;

  /// The changes of the two channels. finished: the touch has its samples, or has been released.
  constexpr Report<Real> feed(Real hard, Real soft) noexcept {
    const Real change = magnitude(hard + soft);
    if (PALPATE_UNLIKELY(!(change < settings.full_scale))) {
      return {estimator.ratio(), false, gate.contact(), false};
    }
    const bool was_in_contact = gate.contact();
    const bool contact = gate.update(change, settings.noise);
    if (contact && !was_in_contact) {
      estimator.reset(settings.initial_ratio, settings.initial_covariance);
      wanted_ = settings.samples;
    }
    if (wanted_ == 0) {
      return {estimator.ratio(), false, contact, false};
    }
    if (contact) {
      return take(hard, soft);
    }
    wanted_ = 0;
    return {estimator.ratio(), false, false, true};
  }

  /// Samples of the running touch that are still to come; 0 where none is running.
  constexpr std::uint32_t wanted() const noexcept { return wanted_; }

 private:
  constexpr Report<Real> take(Real hard, Real soft) noexcept {
    const auto step = estimator.update(hard, soft);
    wanted_ -= step.accepted;
    return {step.ratio, step.alarm, true, wanted_ == 0};
  }

  std::uint32_t wanted_ = 0;
};

}  // namespace palpate
