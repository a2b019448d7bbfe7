// SPDX-License-Identifier: MIT
#pragma once

#include <cstdint>
#include <limits>

/// One conversion of each channel: times in us, capacitances in pF.
struct Reading {
  std::uint32_t t_hard, t_soft;
  float hard, soft;
};

/// Two touches with tremor and with the most expensive events: a spike, a NaN, a change of the ratio (and so an alarm),
/// an end by count and one by release. Integers scaled by powers of two, so that every processor computes the same.
class Readings {
 public:
  static constexpr int size = 640;
  static constexpr float idle_hard = 0.625f, idle_soft = -0.375f;

  /// Whether a reading is of a touch, or of the release that ends it.
  static constexpr bool touched(int i) noexcept { return (i >= 60 && i < 368) || (i >= 440 && i < 588); }

  Reading next() noexcept {
    const int i = i_++;
    const auto t = static_cast<std::uint32_t>(26000 * i + 37 * (i % 5));
    const std::int32_t ratio = i < 200 ? 20 : i < 430 ? 26 : 63;  // in eighths
    const std::int32_t hard = press(2 * i) / 8 * ratio + noise() + (i == 150 ? 400000 : 0);
    const float soft = picofarad(press(2 * i + 1) + noise()) + idle_soft;
    return {t, t + 13000, i == 170 ? std::numeric_limits<float>::quiet_NaN() : picofarad(hard) + idle_hard, soft};
  }

 private:
  static float picofarad(std::int32_t value) noexcept { return static_cast<float>(value) / 1048576; }

  // At half readings: 0.25 pF and a triangular tremor of 3 %, 20 half readings long; then a lighter touch.
  static std::int32_t press(int half) noexcept {
    const int phase = half % 20;
    const std::int32_t tremor = 786 * (phase < 10 ? phase - 5 : 15 - phase) / 5;
    return half >= 120 && half < 720 ? 262144 + 10 * tremor : half >= 880 && half < 1160 ? 65536 + 2 * tremor : 0;
  }

  std::int32_t noise() noexcept {  // 1.5e-5 pF, uniform
    state_ = state_ * 1664525u + 1013904223u;
    return static_cast<std::int32_t>(state_ >> 26) - 32;
  }

  int i_ = 0;
  std::uint32_t state_ = 12345;
};

// Results of a subject for the readings, as bits.

/// Print a text: each program defines it.
void put(const char* text);
/// Print all results.
void run();
/// Print a line for each subject, with a hash of all its states, and a line for each touch.
void print_results();

inline void put_hex(std::uint32_t value) {
  char text[9] = {};
  for (int i = 7; i >= 0; --i, value >>= 4) {
    text[i] = "0123456789abcdef"[value & 15];
  }
  put(text);
}

inline void put_number(std::uint32_t value) {
  char text[11] = {};
  int i = 10;
  do {
    text[--i] = static_cast<char>('0' + value % 10);
    value /= 10;
  } while (value > 0);
  put(text + i);
}
