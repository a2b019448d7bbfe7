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
    require_share(s, "forgetting");
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
    require_share(s, "steady");
    require(s["alarmed"] > 0 && s["alarmed"] <= s["steady"], "alarmed", s["alarmed"],
            "0 < alarmed <= steady (" + number(s["steady"]) + ")");
    require(s["drift"] >= 0 && palpate::is_finite(static_cast<float>(s["drift"])), "drift", s["drift"],
            "0 <= drift, finite");
    require(s["threshold"] >= 0, "threshold", s["threshold"], "0 <= threshold");
    require(s["clear_level"] >= 0 && s["clear_level"] <= s["threshold"], "clear_level", s["clear_level"],
            "0 <= clear_level <= threshold (" + number(s["threshold"]) + ")");
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
    require_share(s, "steady");
    require(s["clip"] > 0 && s["clip"] <= 100, "clip", s["clip"], "0 < clip <= 100");
    require(s["drift"] >= 0 && s["drift"] < s["clip"], "drift", s["drift"],
            "0 <= drift < clip (" + number(s["clip"]) + ")");
    require(s["threshold"] > 0, "threshold", s["threshold"], "0 < threshold");
    require_share(s, "smoothing");
    require(s["guard"] >= 0 && s["guard"] <= 100, "guard", s["guard"], "0 <= guard <= 100");
    check_prior<Real>(s);
  }
  static Core core(const Settings& s) {
    return Core({s.values<palpate::HandoverSettings<Real>>()}, static_cast<Real>(s["initial_ratio"]),
                static_cast<Real>(s["initial_covariance"]));
  }
};
