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

/// The readings of a channel, pF.
class Channel {
 public:
  /// Of `size` items, or of any number: -1.
  Channel(py::handle given, const char* name, py::ssize_t size)
      : values_(strided_view<const double>(given, once<&py::dtype::of<double>>())) {
    if (values_.size < 0 || (size >= 0 && values_.size != size)) {
      kept_ = samples_of<double>(py::reinterpret_borrow<py::object>(given), name, {size});
      values_ = View<const double>::of(kept_);
    }
  }
  py::ssize_t size() const { return values_.size; }
  double operator[](py::ssize_t i) const { return values_[i]; }

 private:
  py::array kept_;
  View<const double> values_;
};

/// The times of a channel: seconds as floats, or nanoseconds as integers.
class Times {
 public:
  Times(py::handle given, const char* name, py::ssize_t size)
      : name_(name), nanoseconds_(strided_view<const std::int64_t>(given, once<&py::dtype::of<std::int64_t>>())) {
    if (nanoseconds_.size != size) {
      nanoseconds_ = {};
      convert(py::array(py::reinterpret_borrow<py::object>(given)), size);
    }
  }

  /// Put time i into `ns`; false if a tracker cannot take it.
  bool read(py::ssize_t i, std::int64_t& ns) const {
    if (nanoseconds_.size >= 0) {
      ns = nanoseconds_[i];
      return ns >= least_;
    }
    const double seconds = seconds_[i];
    const bool fits = is_time(seconds);
    ns = fits ? nanoseconds_of(seconds) : 0;
    return fits;
  }

  [[noreturn]] void refuse(py::ssize_t i) const {
    if (nanoseconds_.size >= 0) {
      throw py::value_error(std::string(name_) + ": got " +
                            std::to_string(static_cast<std::uint64_t>(nanoseconds_[i])) +
                            ", allowed: times below 2**63 ns");
    }
    refuse_time(name_, seconds_[i]);
  }

 private:
  void convert(const py::array& array, py::ssize_t size) {
    const char kind = array.dtype().kind();
    if (kind == 'i' || kind == 'u') {
      require_shape(array, name_, {size});
      kept_ = Samples<std::int64_t>(py::object(array));
      nanoseconds_ = View<const std::int64_t>::of(kept_);
      least_ = kind == 'u' ? 0 : least_;  // one above int64 has become negative
    } else {
      kept_ = samples_of<double>(array, name_, {size});
      seconds_ = View<const double>::of(kept_);
    }
  }

  const char* name_;
  py::array kept_;
  View<const double> seconds_;
  View<const std::int64_t> nanoseconds_;
  std::int64_t least_ = std::numeric_limits<std::int64_t>::min();
};

/// A block of readings: the columns of Tracker.process.
struct Readings {
  Channel hard, soft;
  Times t_hard, t_soft;

  Readings(py::handle t_hard_given, py::handle t_soft_given, py::handle hard_given, py::handle soft_given)
      : hard(hard_given, "hard", -1),
        soft(soft_given, "soft", hard.size()),
        t_hard(t_hard_given, "t_hard", hard.size()),
        t_soft(t_soft_given, "t_soft", hard.size()) {}
  py::ssize_t size() const { return hard.size(); }

  /// Put the times of reading i into `hard_ns` and `soft_ns`; returns the channel whose time cannot be taken, or null.
  const Times* read(py::ssize_t i, std::int64_t& hard_ns, std::int64_t& soft_ns) const {
    return !t_hard.read(i, hard_ns) ? &t_hard : !t_soft.read(i, soft_ns) ? &t_soft : nullptr;
  }
};
