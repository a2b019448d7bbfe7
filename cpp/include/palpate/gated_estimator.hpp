// SPDX-License-Identifier: MIT
#pragma once

// Touches for a loop that subtracts the baseline itself: the gate, and an estimator for the first samples of a contact.

#include <palpate/scenes.hpp>

namespace palpate {

/// Settings of a GatedEstimator.
template <class Estimator>
struct GatedSettings {
  using Real = typename Estimator::real_type;  ///< float or double
  Real noise = Real(1e-4);                     ///< standard deviation of the sum of the two changes, pF
  Real full_scale = Real(1e9);   ///< changes are refused if their sum has this size or more, or is not finite
  Real initial_ratio = Real(1);  ///< of the estimator at the begin of a touch
  Real initial_covariance = Estimator::default_covariance;  ///< the same, 1/pF^2
  std::uint32_t samples = 250;                              ///< of a touch

  /// As FixedForgetting::visit_fields.
  template <class Self, class Visit>
  static constexpr void visit_fields(Self& s, Visit&& visit) noexcept {
    visit("noise", s.noise, s.noise > 0, "0 < noise");
    visit("full_scale", s.full_scale, s.full_scale > 0, "0 < full_scale, pF");
    visit("initial_ratio", s.initial_ratio, is_finite(s.initial_ratio), "a finite number");
    visit("initial_covariance", s.initial_covariance, s.initial_covariance > 0, "0 < initial_covariance");
    visit("samples", s.samples, s.samples > 0, "0 < samples");
  }
};

/// As Tracker, without the stages before the gate and without counts.
template <class ContactStage, class Estimator, class Settings = Kept<GatedSettings<Estimator>>>
class GatedEstimator : public Settings {
 public:
  using real_type = typename Estimator::real_type;  ///< float or double
  using Real = real_type;                           ///< the same
  using Settings::settings;

  ContactStage gate;    ///< the begin and the end of a touch
  Estimator estimator;  ///< of the ratio of the running touch, or of the last one

  /// Takes the changes of both channels, pF. finished: the touch has all its samples, or was released.
  constexpr Report<Real> feed(Real hard, Real soft) noexcept {
    const Real change = hard + soft;
    if (PALPATE_UNLIKELY(!(magnitude(change) < settings.full_scale))) {
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

  /// Number of samples that the running touch still needs; 0: no touch is running.
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
