// SPDX-License-Identifier: MIT
#pragma once

// A simulated AD7746 between EXCB and two gauges: registers, conversion time and range as in the data sheet, rev. 0.

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <map>
#include <string>
#include <utility>

/// Two gauges that are pressed in the second half of every 8 s, with a tremor; the hard one changes 2.5 times as much.
inline double picofarad(bool second, double s) noexcept {
  const double phase = std::fmod(s, 8.0) - 4.0, ramp = 0.15;
  const double edge = std::clamp(std::min(phase, 4.0 - phase) / ramp, 0.0, 1.0);
  const double press = edge * edge * (3 - 2 * edge) * (1 + 0.05 * std::sin(50.0 * s));
  return second ? 4.69 + 0.25 * press : 6.92 + 0.625 * press;
}

/// A time span, s of the simulation.
struct Span {
  double begin = 0, end = 0;
  bool has(double s) const noexcept { return begin <= s && s < end; }
};

class Chip {
 public:
  enum Register { status, cap_data, cap_setup = 7, exc_setup = 9, config, capdac_a, count = 0x13 };

  Span absent, overloaded, beyond, garbled;  // no answer; EXCERR; CIN2 with 30 pF; the bit CIN2 is not as written
  std::map<std::string, Span&> spans{
      {"absent", absent}, {"overloaded", overloaded}, {"beyond", beyond}, {"garbled", garbled}};
  int faults = 0;  // transfers that the data sheet forbids

  /// Each conversion is written to `log`, if there is one: middle in us, input, code.
  explicit Chip(std::FILE* log) : log_(log) { reset(); }
  Chip(const Chip&) = delete;

  /// A START with the chip's address: whether it answers.
  bool select(double s) noexcept {
    if (absent.begin <= s && last_ < absent.end) {
      reset();  // also if no one has asked while it had no supply
    }
    last_ = s;
    first_ = true;
    return s >= silent_until_ && !absent.has(s);
  }

  void write(std::uint8_t byte, double s) noexcept {
    end_conversion(s);
    if (std::exchange(first_, false)) {
      pointer_ = byte;
      if (byte == 0xBF) {
        reset();
        silent_until_ = s + 200e-6;
      }
    } else {
      faults += converting_;  // no setting may change during a conversion
      const int at = pointer_++ % count;
      if (at >= cap_setup) {
        registers_[at] = static_cast<std::uint8_t>(byte ^ (at == cap_setup && garbled.has(s) ? 0x40 : 0));
      }
      if (at == config && (byte & 7) == 2 && (registers_[cap_setup] & 0x80)) {
        converting_ = true;
        begun_ = s;
        registers_[status] |= 0x07;
      }
    }
  }

  std::uint8_t read(double s) noexcept {
    end_conversion(s);
    const int at = pointer_++ % count;
    faults += converting_ && at != status;  // a conversion that ends while data are read is lost
    return registers_[at];
  }

 private:
  static constexpr double conversion = 0.011, dac_step = 0.171;

  void reset() noexcept {
    static constexpr std::uint8_t values[count] = {0x07, 0, 0, 0,    0, 0,    0,    0,    0,   3,
                                                   0xA0, 0, 0, 0x80, 0, 0x66, 0xCC, 0x5C, 0x90};
    std::memcpy(registers_, values, count);
    converting_ = false;
  }

  void end_conversion(double s) noexcept {
    if (!converting_ || s < begun_ + conversion) {
      return;
    }
    const double middle = begun_ + conversion / 2;
    const std::uint32_t code = convert(middle);
    if (log_) {
      std::fprintf(log_, "%.3f,%d,%.0f\n", middle * 1e6, registers_[cap_setup] & 0x40 ? 2 : 1,
                   static_cast<double>(code));
    }
    for (int i = 0; i < 3; ++i) {
      registers_[cap_data + i] = static_cast<std::uint8_t>(code >> (16 - 8 * i));
    }
    registers_[status] = static_cast<std::uint8_t>(0x02 | (overloaded.has(middle) ? 0x08 : 0));
    registers_[config] &= 0xF8;
    converting_ = false;
  }

  std::uint32_t convert(double s) noexcept {
    const bool second = (registers_[cap_setup] & 0x40) != 0, driven = (registers_[exc_setup] & 0x30) == 0x20;
    const double gauge = beyond.has(s) && second ? 30 : picofarad(second, s);
    const double dac = registers_[capdac_a] & 0x80 ? (registers_[capdac_a] & 0x7F) * dac_step : 0;
    const double code = std::round(((driven ? gauge + noise() : 0) - dac) * (16777216 / 8.192)) + 0x800000;
    return static_cast<std::uint32_t>(std::clamp(code, 0.0, 16777215.0));
  }

  double noise() noexcept {  // uniform, 40 aF rms
    random_ = random_ * 1664525u + 1013904223u;
    return (random_ / 4294967296.0 - 0.5) * 139e-6;
  }

  std::FILE* log_;
  std::uint8_t registers_[count];
  int pointer_ = 0;
  bool first_ = false, converting_ = false;
  double begun_ = 0, last_ = 0, silent_until_ = 0;
  std::uint32_t random_ = 12345;
};
