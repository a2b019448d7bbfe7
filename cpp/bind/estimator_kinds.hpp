// SPDX-License-Identifier: MIT
#pragma once

// Python's three kinds of estimators: the parts of the core that each is made of, and what is allowed for its settings.

#include <palpate/estimator/handover.hpp>

#include "settings.hpp"

/// The settings of an estimator of type Core, with the defaults of its Parts, structs of the core for double.
template <class Core, class... Parts>
Settings defaults_of() {
  Settings settings;
  (settings.add_fields<Parts>(false), ...);
  settings.add("initial_ratio", Core().ratio());
  settings.add("initial_covariance", Core::default_covariance);
  (settings.add_fields<Parts>(true), ...);
  return settings;
}

template <class Real>
struct FixedKind {
  using Core = palpate::FixedRls<Real>;

  static Settings defaults() {
    return defaults_of<palpate::FixedRls<double>, palpate::FixedForgetting<double>,
                       palpate::BoundedCovariance<double>>();
  }
  static void check(const Settings& s) {
    s.check<palpate::FixedForgetting<double>>();
    check_prior<Real>(s);
  }
  static Core core(const Settings& s) {
    return Core(s.values<palpate::FixedForgetting<Real>>(), {}, s.values<palpate::BoundedCovariance<Real>>(),
                static_cast<Real>(s["initial_ratio"]), static_cast<Real>(s["initial_covariance"]));
  }
};

template <class Real>
struct AdaptiveKind {
  using Core = palpate::AdaptiveRls<Real>;

  static Settings defaults() {
    return defaults_of<palpate::AdaptiveRls<double>, palpate::SwitchedForgetting<double>,
                       palpate::CusumSettings<double>, palpate::BoundedCovariance<double>>();
  }
  static void check(const Settings& s) {
    s.check<palpate::SwitchedForgetting<double>>();
    s.check<palpate::CusumSettings<double>>();
    check_prior<Real>(s);
  }
  static Core core(const Settings& s) {
    return Core(s.values<palpate::SwitchedForgetting<Real>>(), {{s.values<palpate::CusumSettings<Real>>()}},
                s.values<palpate::BoundedCovariance<Real>>(), static_cast<Real>(s["initial_ratio"]),
                static_cast<Real>(s["initial_covariance"]));
  }
};

template <class Real>
struct HandoverKind {
  using Core = palpate::Handover<Real>;

  static Settings defaults() { return defaults_of<palpate::Handover<double>, palpate::HandoverSettings<double>>(); }
  static void check(const Settings& s) {
    s.check<palpate::HandoverSettings<double>>();
    check_prior<Real>(s);
  }
  static Core core(const Settings& s) {
    return Core({s.values<palpate::HandoverSettings<Real>>()}, static_cast<Real>(s["initial_ratio"]),
                static_cast<Real>(s["initial_covariance"]));
  }
};
