// SPDX-License-Identifier: MIT
#pragma once

// Python's estimator of several coefficients: the core of its size, and the calls that take rows of regressors.

#include <algorithm>
#include <array>
#include <palpate/estimator/vector_rls.hpp>
#include <utility>
#include <variant>

#include "estimator.hpp"
#include "estimator_kinds.hpp"

using VectorSettings = palpate::VectorSettings<double>;

/// A VectorRls of any size, as OneRatio. An intercept is a last regressor, 1.
class AnyVector {
  template <int N>
  using Core = palpate::VectorRls<double, N>;
  using Cores = std::variant<Core<1>, Core<2>, Core<3>, Core<4>, Core<5>, Core<6>, Core<7>, Core<8>>;

 public:
  using real_type = double;
  using Numbers = std::array<double, 8>;
  static constexpr bool is_vector = true;
  static constexpr auto explains = "regressors";

  explicit AnyVector(const Settings& s);

  auto take(double output, const double* regressors) noexcept {
    const auto update = [&](auto& core) {
      constexpr std::size_t last = std::decay_t<decltype(core)>::size - 1;
      double given[last + 1];
      std::copy_n(regressors, last, given);
      given[last] = intercept_ ? 1 : regressors[last];
      return core.update(output, given);
    };
    return std::visit(update, core_);
  }
  palpate::Prediction<double> predict(const double* regressors) const noexcept {
    const auto predicted = [&](const auto& core) {
      constexpr std::size_t last = std::decay_t<decltype(core)>::size - 1;
      double given[last + 1];
      std::copy_n(regressors, last, given);
      given[last] = intercept_ ? 1 : regressors[last];
      return core.predict(given);
    };
    return std::visit(predicted, core_);
  }
  py::ssize_t width() const noexcept { return count() - intercept_; }
  py::ssize_t count() const noexcept { return static_cast<py::ssize_t>(core_.index()) + 1; }
  double* write(double* to) const noexcept { return std::copy_n(coefficients(), count(), to); }
  double* write_spread(double* to) const noexcept { return std::copy_n(standard_errors().begin(), count(), to); }

  /// A column of the covariance; as many numbers as coefficients.
  Numbers covariance(int column) const noexcept {
    return filled([column](const auto& core, auto& values) { core.covariance(column, values); });
  }
  Numbers standard_errors() const noexcept {
    return filled([](const auto& core, auto& values) { core.standard_errors(values); });
  }
  double degrees_of_freedom() const noexcept {
    double degrees = 0;
    filled([&](const auto& core, auto& values) { degrees = core.standard_errors(values); });
    return degrees;
  }
  const double* coefficients() const noexcept {
    return std::visit([](const auto& core) { return core.coefficients(); }, core_);
  }
  double statistic() const noexcept {
    return std::visit([](const auto& core) { return core.statistic(); }, core_);
  }
  bool alarm() const noexcept {
    return std::visit([](const auto& core) { return core.alarm(); }, core_);
  }
  double threshold() const noexcept {
    return std::visit([](const auto& core) { return core.settings.threshold; }, core_);
  }
  double information() const noexcept { return 1 / covariance(0)[0]; }
  template <class Visit>
  void visit_state(Visit&& visitor) noexcept {
    std::visit([&](auto& core) { core.visit_state(visitor); }, core_);
  }

 private:
  template <std::size_t I>
  void emplace(std::size_t index, const palpate::Kept<VectorSettings>& settings, double covariance) {
    if (I == index) {
      core_.emplace<I>(settings, covariance);
    } else if constexpr (I < 7) {
      emplace<I + 1>(index, settings, covariance);
    }
  }
  template <class Fill>
  Numbers filled(Fill fill) const noexcept {
    const auto copied = [&](const auto& core) {
      double values[std::decay_t<decltype(core)>::size];
      fill(core, values);
      Numbers numbers{};
      std::copy(std::begin(values), std::end(values), numbers.begin());
      return numbers;
    };
    return std::visit(copied, core_);
  }

  bool intercept_;
  Cores core_;
};

inline double threshold_of(const AnyVector& core) { return core.threshold(); }

struct VectorKind {
  using Core = AnyVector;
  static Settings defaults();
  static void check(const Settings& s);
  static Core core(const Settings& s) { return Core(s); }
};
