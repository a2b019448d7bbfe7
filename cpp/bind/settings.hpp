// SPDX-License-Identifier: MIT
#pragma once

// Settings as Python gives them: named numbers, kept as given for repr, == and pickle. Their names and defaults are
// those of the core's structs, and so are their ranges.

#include <array>
#include <cstring>
#include <limits>
#include <palpate/arithmetic.hpp>
#include <string>

#include "methods.hpp"

inline std::string number(double value) { return py::repr(py::float_(value)).cast<std::string>(); }

/// "got 'x', allowed: y, z; did you mean 'y'?", by palpate.errors.
inline std::string unlike(const py::object& given, const py::list& names, const char* what = "") {
  return py::module_::import("palpate.errors").attr("unlike")(given, names, what).cast<std::string>();
}

inline void require(bool ok, const char* name, double value, const std::string& allowed) {
  if (!ok) {
    throw py::value_error(std::string(name) + ": got " + number(value) + ", allowed: " + allowed);
  }
}

class Settings {
 public:
  struct Setting {
    const char* name;
    double value;
  };

  void add(const char* name, double value) noexcept { settings_[size_++] = {name, value}; }

  /// The fields of a struct of the core, in its order; or only min_information, which in Python is 1 / max_covariance.
  template <class Values>
  void add_fields(bool bound, const Values& values = Values()) noexcept {
    Values::visit_fields(values, [&](const char* name, auto value, bool, const char*) {
      if (is_bound(name) == bound) {
        add(bound ? "max_covariance" : name, bound ? 1 / static_cast<double>(value) : static_cast<double>(value));
      }
    });
  }

  /// The struct of the core with these settings; its own where there is no such setting.
  template <class Values>
  Values values() const noexcept {
    Values values;
    Values::visit_fields(values, [&](const char* name, auto& value, bool, const char*) {
      using Real = std::decay_t<decltype(value)>;
      if (is_bound(name)) {
        value = 1 / static_cast<Real>((*this)["max_covariance"]);
      } else if (find(name) != end()) {
        value = static_cast<Real>((*this)[name]);
      }
    });
    return values;
  }

  /// ValueError for the first setting that a struct of the core does not allow.
  template <class Values>
  void check() const {
    const Setting* wrong = end();
    const char* range = nullptr;
    const Values given = values<Values>();
    Values::visit_fields(given, [&](const char* name, const auto&, bool allowed, const char* text) {
      if (!allowed && wrong == end() && !is_bound(name)) {
        wrong = find(name), range = text;
      }
    });
    if (wrong != end()) {
      const std::string text = range;
      const Setting* const other = find(text.substr(text.rfind(' ') + 1));
      require(false, wrong->name, wrong->value,
              other == end() || other == wrong ? text : text + " (" + number(other->value) + ")");
    }
  }

  double operator[](const char* name) const noexcept { return find(name)->value; }
  const Setting* begin() const noexcept { return settings_.data(); }
  const Setting* end() const noexcept { return settings_.data() + size_; }
  std::size_t size() const noexcept { return size_; }

  bool operator==(const Settings& other) const { return dict().equal(other.dict()); }
  /// As keywords: {name: value}; samples a whole number or None, seconds None for any, a switch True or False.
  py::dict dict() const;
  /// "steady=0.995, drift=0.75"
  std::string text() const;
  /// These, with those that are given in their place. A name that is not here is `owner`'s TypeError.
  Settings with(const char* owner, const py::dict& given) const;

 private:
  static bool is_bound(const char* name) noexcept { return std::strcmp(name, "min_information") == 0; }
  const Setting* find(const std::string& name) const noexcept;
  void set(const char* name, double value) noexcept {
    settings_[static_cast<std::size_t>(find(name) - begin())].value = value;
  }
  void choose_length(const py::dict& given);

  std::array<Setting, 27> settings_{};
  std::size_t size_ = 0;
};

/// Covariance and information are kept to the normal numbers of Real, where arithmetic is exact to an eps and fast.
template <class Real>
void check_covariance(const Settings& s) {
  constexpr double smallest = std::numeric_limits<Real>::min();
  const double largest = 1 / smallest, initial = s["initial_covariance"], most = s["max_covariance"];
  require(most >= smallest && most <= largest, "max_covariance", most,
          number(smallest) + " <= max_covariance <= " + number(largest));
  require(initial >= smallest && initial <= most, "initial_covariance", initial,
          number(smallest) + " <= initial_covariance <= max_covariance (" + number(most) + ")");
}
template <class Real>
void check_prior(const Settings& s) {
  const double ratio = s["initial_ratio"];
  require(palpate::is_finite(static_cast<Real>(ratio)), "initial_ratio", ratio, "a finite number");
  check_covariance<Real>(s);
}
