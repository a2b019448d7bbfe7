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

/// A VectorRls of any size. An intercept is a last regressor, 1.
class AnyVector {
  template <int N>
  using Core = palpate::VectorRls<double, N>;
  template <int... N>
  static std::variant<Core<N + 1>...> any(std::integer_sequence<int, N...>);
  using Cores = decltype(any(std::make_integer_sequence<int, 8>()));

 public:
  using real_type = double;
  static constexpr std::size_t most = 8;  // coefficients
  using Numbers = std::array<double, most>;

  explicit AnyVector(const Settings& s);

  /// From the first size() of the values.
  auto update(double output, const double* values) noexcept {
    const auto take = [&](auto& core) {
      constexpr std::size_t last = std::decay_t<decltype(core)>::size - 1;
      double given[last + 1];
      std::copy_n(values, last, given);
      given[last] = intercept_ ? 1 : values[last];
      return core.update(output, given);
    };
    return std::visit(take, core_);
  }
  std::size_t size() const noexcept { return size_; }
  std::size_t coefficient_count() const noexcept { return size_ + intercept_; }
  const double* coefficients() const noexcept {
    return std::visit([](const auto& core) { return core.coefficients(); }, core_);
  }
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
  double statistic() const noexcept {
    return std::visit([](const auto& core) { return core.statistic(); }, core_);
  }
  bool alarm() const noexcept {
    return std::visit([](const auto& core) { return core.alarm(); }, core_);
  }
  double information() const noexcept { return 1 / covariance(0)[0]; }
  template <class Visit>
  void visit_state(Visit&& visitor) noexcept {
    std::visit([&](auto& core) { core.visit_state(visitor); }, core_);
  }

 private:
  template <std::size_t... I>
  static Cores made(const Settings& s, std::index_sequence<I...>);
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

  std::size_t size_;
  bool intercept_;
  Cores core_;
};

struct VectorKind {
  using Core = AnyVector;
  static Settings defaults();
  static void check(const Settings& s);
  static Core core(const Settings& s) { return Core(s); }
};

class VectorEstimator : public Estimator<VectorKind> {
 public:
  using Estimator::Estimator;
  explicit VectorEstimator(const Estimator& other) : Estimator(other) {}

  double update(py::handle output, py::handle regressors);
  py::object process(const py::object& output, const py::object& regressors, const py::object& out);
  py::object trace(const py::object& output, const py::object& regressors, const py::object& out);
};
