// SPDX-License-Identifier: MIT
#pragma once

// Settings as Python gives them: named numbers, kept as given for repr, == and pickle. Their names and defaults are
// those of the core's structs, and so are their ranges.

#include <array>
#include <cstring>
#include <limits>
#include <optional>
#include <string>

#include "methods.hpp"

inline std::string number(double value) { return text_of(py::float_(value)); }

/// "got 'x', allowed: y, z; did you mean 'y'?", by palpate.messages.
inline std::string unlike(const py::object& given, const py::list& names, const char* what = "") {
  return text_of(py::module_::import("palpate.messages").attr("unlike")(given, names, what));
}

inline void require(bool ok, const char* name, double value, const std::string& allowed) {
  if (!ok) {
    refuse<value_error>(name, value, allowed);
  }
}

class Settings {
 public:
  void add(const char* name, double value);
  void add_all(const Settings& others) { all_.attr("update")(others.all_); }

  /// The fields of a struct of the core, in its order; or only min_information, which in Python is 1 / max_covariance.
  template <class Values>
  void add_fields(bool bound, const Values& values = Values()) {
    Values::visit_fields(values, [&](const char* name, auto value, bool, const char*) {
      if (is_bound(name) == bound) {
        add(bound ? "max_covariance" : name, bound ? 1 / static_cast<double>(value) : static_cast<double>(value));
      }
    });
  }

  /// The struct of the core with these settings; its own where there is no such setting.
  template <class Values>
  Values values() const {
    Values values;
    Values::visit_fields(values, [&](const char* name, auto& value, bool, const char*) {
      using Real = std::decay_t<decltype(value)>;
      if (is_bound(name)) {
        value = 1 / static_cast<Real>((*this)["max_covariance"]);
      } else if (all_.contains(name)) {
        value = static_cast<Real>((*this)[name]);
      }
    });
    return values;
  }

  /// ValueError for the first setting that a struct of the core does not allow.
  template <class Values>
  void check() const {
    std::string wrong, range;
    const Values given = values<Values>();
    Values::visit_fields(given, [&](const char* name, const auto&, bool allowed, const char* text) {
      if (!allowed && wrong.empty() && all_.contains(name)) {
        wrong = name, range = text;
      }
    });
    if (!wrong.empty()) {
      const std::string last = range.substr(range.rfind(' ') + 1);
      const bool is_other = last != wrong && all_.contains(last);
      refuse<value_error>(wrong, (*this)[wrong], is_other ? range + " (" + number((*this)[last]) + ")" : range);
    }
  }

  void add_baseline() { all_["baseline"] = "measured"; }
  /// Where it is given: the levels of both channels, 0 for "zero", and their noise, 0 where it is measured.
  std::optional<std::array<double, 4>> baseline() const;

  /// None is 0.
  double operator[](const std::string& name) const {
    const py::object value = all_[name.c_str()];
    return value.is_none() ? 0 : value.cast<double>();
  }
  /// As keywords: {name: value}; samples a whole number or None, seconds None for any, a switch True or False.
  py::dict dict() const { return all_.attr("copy")(); }
  /// "steady=0.995, drift=0.75"
  std::string text() const;
  /// These, with those that are given in their place. A name that is not here is `owner`'s TypeError.
  Settings with(const char* owner, const py::dict& given) const;

 private:
  static bool is_bound(const char* name) noexcept { return std::strcmp(name, "min_information") == 0; }

  py::dict all_;  // shared by copies: not changed but by add
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
