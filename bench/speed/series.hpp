// SPDX-License-Identifier: MIT
#pragma once

// Data of the benches: a held press with tremor and converter noise, as changes of the two channels and as readings.

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

constexpr double truth = 2.5;

/// The same numbers on every machine, evenly from -0.7e-4 to 0.7e-4.
class Noise {
 public:
  double next() {
    state_ = state_ * 1664525u + 1013904223u;
    return (static_cast<double>(state_ >> 8) / 16777216 - 0.5) * 1.4e-4;
  }
  bool coin() const { return state_ >> 20 & 1; }

 private:
  std::uint32_t state_ = 1;
};

/// Changes of both channels. flicker: bursts that turn the alarm of the paper on and off; idle: regressor 0.
struct Series {
  std::vector<double> output, regressor;

  explicit Series(std::size_t size, bool flicker = false, bool idle = false) {
    Noise noise;
    for (std::size_t i = 0; i < size; ++i) {
      const double n = noise.next();
      const double burst = flicker && i / 4 % 2 ? (noise.coin() ? 0.03 : -0.03) : 0.0;
      const double x = idle ? 0.0 : 0.25 * (1 + 0.03 * std::sin(1.3 * static_cast<double>(i)));
      regressor.push_back(x);
      output.push_back(truth * x + n + burst);
    }
  }
};

/// HeldReadings: 60 without contact, then a long hold with tremor. The hold goes on in the next chunk.
struct HeldReadings {
  static constexpr std::size_t idle = 60;
  std::vector<std::int64_t> t_hard, t_soft;
  std::vector<double> hard, soft;

  explicit HeldReadings(std::size_t size) {
    Noise noise;
    for (std::size_t i = 0; i < size; ++i) {
      const auto t = 26000000 * static_cast<std::int64_t>(i) + static_cast<std::int64_t>(i % 7) * 50000;
      const auto press = [&](std::int64_t at) {
        const double s = static_cast<double>(at) * 1e-9;
        return i < idle ? 0.0 : 0.25 * (1 + 0.03 * std::sin(50 * s) + 0.01 * std::sin(27 * s));
      };
      t_hard.push_back(t);
      t_soft.push_back(t + 13000000);
      hard.push_back(0.6 + truth * press(t) + noise.next());
      soft.push_back(press(t + 13000000) - 0.4 + noise.next());
    }
  }
};

/// Where a function of a bench is in its data: chunk after chunk, from the start again at the end.
class Cursor {
 public:
  Cursor(std::size_t chunk, std::size_t end, std::size_t start = 0)
      : chunk_(chunk), end_(end), start_(start), at_(start) {}

  std::size_t at() const { return at_; }
  /// Go to the next chunk, and read its values in these arrays into the cache.
  template <class... Array>
  void renew(const Array&... arrays) {
    at_ = at_ + 2 * chunk_ <= end_ ? at_ + chunk_ : start_;
    volatile double sink = 0;
    const auto touch = [&](const auto& array) {
      double sum = 0;
      for (std::size_t i = at_; i < at_ + chunk_; ++i) {
        sum += static_cast<double>(array[i]);
      }
      sink = sum;
    };
    (touch(arrays), ...);
    static_cast<void>(sink);
  }

 private:
  std::size_t chunk_, end_, start_, at_;
};
