// SPDX-License-Identifier: MIT
#pragma once

// The parameters of each estimator, and the core, or the loop of a bank, that they make.

#include <palpate/estimator/handover.hpp>

#include "bank_loops.hpp"
#include "settings.hpp"
#include "trace_row.hpp"

template <class Real>
struct RlsSettings {
  using Core = palpate::FixedRls<Real>;
  using Row = TraceRow<Real>;
  static constexpr bool has_detector = false;
  double forgetting = 0.995, initial_ratio = 1.0, initial_covariance = 1e4, max_covariance = 1e6;

  static constexpr std::array<Field<RlsSettings>, 4> fields() {
    return {{{"forgetting", &RlsSettings::forgetting},
             {"initial_ratio", &RlsSettings::initial_ratio},
             {"initial_covariance", &RlsSettings::initial_covariance},
             {"max_covariance", &RlsSettings::max_covariance}}};
  }

  void check() const {
    require(is_forgetting(forgetting), "forgetting", forgetting, "0 < forgetting <= 1");
    check_prior<Real>(*this);
  }

  Core core() const {
    return Core({static_cast<Real>(forgetting)}, {}, {1 / static_cast<Real>(max_covariance)},
                static_cast<Real>(initial_ratio), static_cast<Real>(initial_covariance));
  }

  BankTask<Real> task() const {
    const auto factor = static_cast<Real>(forgetting);
    return {factor, factor, 0, 0, 1 / static_cast<Real>(max_covariance)};
  }
  static auto loop(const BankLoops& loops) {
    if constexpr (sizeof(Real) == 8) {
      return loops.fixed;
    } else {
      return loops.fixed32;
    }
  }
};

template <class Real>
struct AdaptiveSettings {
  using Core = palpate::AdaptiveRls<Real>;
  using Row = TraceRow<Real>;
  static constexpr bool has_detector = true;
  double steady = 0.995, alarmed = 0.9, drift = 0.01, threshold = 0.05;
  double initial_ratio = 1.0, initial_covariance = 1e4, max_covariance = 1e6;

  static constexpr std::array<Field<AdaptiveSettings>, 7> fields() {
    return {{{"steady", &AdaptiveSettings::steady},
             {"alarmed", &AdaptiveSettings::alarmed},
             {"drift", &AdaptiveSettings::drift},
             {"threshold", &AdaptiveSettings::threshold},
             {"initial_ratio", &AdaptiveSettings::initial_ratio},
             {"initial_covariance", &AdaptiveSettings::initial_covariance},
             {"max_covariance", &AdaptiveSettings::max_covariance}}};
  }

  void check() const {
    check_adaptive(*this);
    check_prior<Real>(*this);
  }

  Core core() const {
    return Core({static_cast<Real>(steady), static_cast<Real>(alarmed)},
                {static_cast<Real>(drift), static_cast<Real>(threshold)}, {1 / static_cast<Real>(max_covariance)},
                static_cast<Real>(initial_ratio), static_cast<Real>(initial_covariance));
  }

  BankTask<Real> task() const {
    const auto real = [](double value) { return static_cast<Real>(value); };
    return {real(steady), real(alarmed), real(drift), real(threshold), 1 / real(max_covariance)};
  }
  static auto loop(const BankLoops& loops) {
    if constexpr (sizeof(Real) == 8) {
      return loops.adaptive;
    } else {
      return loops.adaptive32;
    }
  }
};

template <class Real>
struct HandoverSettings {
  using Core = palpate::Handover<Real>;
  using Row = HandoverRow<Real>;
  double steady = 0.995, drift = 0.75, threshold = 8.0, clip = 3.0, smoothing = 0.0625;
  double initial_ratio = 1.0, initial_covariance = 1e10, max_covariance = 1e12;

  static constexpr std::array<Field<HandoverSettings>, 8> fields() {
    return {{{"steady", &HandoverSettings::steady},
             {"drift", &HandoverSettings::drift},
             {"threshold", &HandoverSettings::threshold},
             {"clip", &HandoverSettings::clip},
             {"smoothing", &HandoverSettings::smoothing},
             {"initial_ratio", &HandoverSettings::initial_ratio},
             {"initial_covariance", &HandoverSettings::initial_covariance},
             {"max_covariance", &HandoverSettings::max_covariance}}};
  }

  void check() const {
    check_handover(*this);
    check_prior<Real>(*this);
  }

  Core core() const {
    const auto real = [](double value) { return static_cast<Real>(value); };
    return Core({real(steady), real(drift), real(threshold), real(clip), real(smoothing), 1 / real(max_covariance)},
                real(initial_ratio), real(initial_covariance));
  }
};
