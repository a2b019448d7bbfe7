// SPDX-License-Identifier: MIT
#pragma once

// Python's three kinds of estimators: the parts of the core that each is made of, and what is allowed for its settings.

#include <palpate/arithmetic.hpp>
#include <palpate/estimator/adaptive_window.hpp>
#include <palpate/estimator/handover.hpp>
#include <palpate/policy/policies.hpp>

#include "arrays.hpp"
#include "detector.hpp"
#include "settings.hpp"

/// An estimator of a ratio, as the blocks take all estimators.
template <class Core>
struct OneRatio : Core {
  using Real = typename Core::real_type;
  using Core::Core;
  static constexpr bool is_vector = false;
  static constexpr auto explains = "regressor";

  auto take(Real output, const Real* regressor) noexcept { return Core::update(output, *regressor); }
  /// Axes of the regressors and of the results of a sample.
  py::ssize_t width() const noexcept { return no_axis; }
  py::ssize_t count() const noexcept { return no_axis; }
  /// Write the results, or what only trace() has of them, to where the returned place ends.
  Real* write(Real* to) const noexcept {
    *to = Core::ratio();
    return to + 1;
  }
  Real* write_spread(Real* to) const noexcept {
    *to = Core::covariance();
    return to + 1;
  }
};

template <class Real>
void check_ratio(const Settings& s) {
  const double ratio = s["initial_ratio"];
  require(palpate::is_finite(static_cast<Real>(ratio)), "initial_ratio", ratio, "a finite number");
}

/// An estimator with the settings of its Parts, structs of the core, and those of its first ratio.
template <class Real, template <class> class Estimator, template <class> class... Parts>
struct KindOf {
  using Core = OneRatio<Estimator<Real>>;

  static Settings defaults() {
    Settings settings;
    (settings.add_fields<Parts<double>>(false), ...);
    settings.add("initial_ratio", Estimator<double>().ratio());
    settings.add("initial_covariance", Estimator<double>::default_covariance);
    (settings.add_fields<Parts<double>>(true), ...);
    return settings;
  }
  static void check(const Settings& s) {
    (s.check<Parts<double>>(), ...);
    check_ratio<Real>(s);
    check_covariance<Real>(s);
  }

 protected:
  /// With what comes before the first ratio and its covariance.
  template <class... First>
  static Core made(const Settings& s, const First&... first) {
    return Core(first..., static_cast<Real>(s["initial_ratio"]), static_cast<Real>(s["initial_covariance"]));
  }
};

template <class Real>
struct FixedKind : KindOf<Real, palpate::FixedRls, palpate::FixedForgetting, palpate::BoundedCovariance> {
  static auto core(const Settings& s) {
    return FixedKind::made(s, s.values<palpate::FixedForgetting<Real>>(), palpate::NoDetector<Real>(),
                           s.values<palpate::BoundedCovariance<Real>>());
  }
};

template <class Real>
struct AdaptiveKind : KindOf<Real, palpate::AdaptiveRls, palpate::SwitchedForgetting, palpate::CusumSettings,
                             palpate::BoundedCovariance> {
  static auto core(const Settings& s) {
    return AdaptiveKind::made(s, s.values<palpate::SwitchedForgetting<Real>>(),
                              palpate::Cusum<Real>{{s.values<palpate::CusumSettings<Real>>()}},
                              s.values<palpate::BoundedCovariance<Real>>());
  }
};

/// The estimator of the scene handheld, which takes its settings.
template <class Real>
using DefaultHandover = palpate::Handover<Real>;
template <class Real>
using HandoverWithoutCusum = WithoutCusum<palpate::HandoverSettings<Real>>;
template <class Real>
struct HandoverKind : KindOf<Real, DefaultHandover, HandoverWithoutCusum> {
  using Others = KindOf<Real, DefaultHandover, HandoverWithoutCusum>;

  static Settings defaults() {
    Settings settings = goal_settings();
    settings.add_all(Others::defaults());
    return settings;
  }
  static void check(const Settings& s) {
    check_goal(s);
    Others::check(s);
  }
  static auto core(const Settings& s) {
    const auto settings = with_cusum<palpate::HandoverSettings<Real>>(s, design::handover_share);
    return HandoverKind::made(s, palpate::Kept<palpate::HandoverSettings<Real>>{settings});
  }
};

/// HandoverRls, and the estimator of the scene sliding, which takes its settings.
template <class Real>
struct WindowKind {
  using Core = OneRatio<palpate::AdaptiveWindow<Real>>;
  template <class Number>
  using Given = palpate::AdaptiveWindowSettings<Number>;

  static Settings defaults() {
    Settings settings = goal_settings();
    settings.add_fields<WithoutCusum<Given<double>>>(false);
    settings.add("initial_ratio", palpate::AdaptiveWindow<double>().ratio());
    return settings;
  }
  static void check(const Settings& s) {
    check_goal(s);
    s.check<WithoutCusum<Given<double>>>();
    check_ratio<Real>(s);
  }
  static Core core(const Settings& s) {
    const auto settings = with_cusum<Given<Real>>(s, design::window_share);
    return Core(palpate::Kept<Given<Real>>{settings}, static_cast<Real>(s["initial_ratio"]));
  }
};
