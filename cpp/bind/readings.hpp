// SPDX-License-Identifier: MIT
#pragma once

// The columns of a block of readings, as the caller's memory has them: of any stride, read without the lock of Python.

#include <cmath>
#include <cstdint>
#include <limits>
#include <string>

#include "arrays.hpp"
#include "settings.hpp"

/// As std::llround(seconds * 1e9), without a call; |seconds| < 9e9.
inline std::int64_t nanoseconds_of(double seconds) {
  const double exact = palpate::product(seconds, 1e9);
  const auto whole = static_cast<std::int64_t>(exact);
  const double rest = exact - static_cast<double>(whole);  // both are multiples of the last place: no rounding
  return whole + (rest >= 0.5) - (rest <= -0.5);
}
inline bool is_time(double seconds) { return std::abs(seconds) < 9e9; }
[[noreturn]] inline void refuse_time(const char* name, double seconds) {
  throw py::value_error(std::string(name) + ": got " + number(seconds) + ", allowed: finite times, s, within 9e9 of 0");
}

/// The times of a channel: seconds as floats, or nanoseconds as integers.
class Times {
 public:
  Times(const py::object& given, const char* name, py::ssize_t size) : name_(name) {
    const py::array array(given);
    const char kind = array.dtype().kind();
    if (kind == 'i' || kind == 'u') {
      require_shape(array, name, {size});
      kept_ = py::array_t<std::int64_t, py::array::forcecast | aligned>(array);
      nanoseconds_ = View<const std::int64_t>(kept_);
      least_ = kind == 'u' ? 0 : least_;  // one above int64 has become negative
    } else {
      kept_ = samples_of<double>(array, name, {size});
      seconds_ = View<const double>(kept_);
    }
  }

  /// Put time i into `ns`; false if a tracker cannot take it.
  bool read(py::ssize_t i, std::int64_t& ns) const {
    if (nanoseconds_.data) {
      ns = nanoseconds_[i];
      return ns >= least_;
    }
    const double seconds = seconds_[i];
    const bool fits = is_time(seconds);
    ns = fits ? nanoseconds_of(seconds) : 0;
    return fits;
  }

  [[noreturn]] void refuse(py::ssize_t i) const {
    if (nanoseconds_.data) {
      throw py::value_error(std::string(name_) + ": got " +
                            std::to_string(static_cast<std::uint64_t>(nanoseconds_[i])) +
                            ", allowed: times below 2**63 ns");
    }
    refuse_time(name_, seconds_[i]);
  }

 private:
  const char* name_;
  py::array kept_;
  View<const double> seconds_;
  View<const std::int64_t> nanoseconds_;
  std::int64_t least_ = std::numeric_limits<std::int64_t>::min();
};

/// A block of readings: the columns of Tracker.process.
struct Readings {
  py::array kept_hard, kept_soft;
  View<const double> hard, soft;
  Times t_hard, t_soft;

  Readings(const py::object& t_hard_given, const py::object& t_soft_given, const py::object& hard_given,
           const py::object& soft_given)
      : kept_hard(samples_of<double>(hard_given, "hard", {-1})),
        kept_soft(samples_of<double>(soft_given, "soft", {kept_hard.shape(0)})),
        hard(kept_hard),
        soft(kept_soft),
        t_hard(t_hard_given, "t_hard", hard.size),
        t_soft(t_soft_given, "t_soft", hard.size) {}

  /// Put the times of reading i into `hard_ns` and `soft_ns`; returns the channel whose time cannot be taken, or null.
  const Times* read(py::ssize_t i, std::int64_t& hard_ns, std::int64_t& soft_ns) const {
    return !t_hard.read(i, hard_ns) ? &t_hard : !t_soft.read(i, soft_ns) ? &t_soft : nullptr;
  }
};
