// SPDX-License-Identifier: MIT
#pragma once

// Timing of short functions: chunks of about 50 us, many repeats, and all items of a run alternately, so that a slow
// moment of the machine affects all of them.

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

using Clock = std::chrono::steady_clock;

inline double ns_since(Clock::time_point start) {
  return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
}

/// ns of one integer multiplication that depends on the one before it: 3 cycles on x86-64.
inline double multiply_ns() {
  constexpr int steps = 3000;
  double best = 1e9;
  std::uint64_t value = 3;
  for (int repeat = 0; repeat < 300; ++repeat) {
    const auto start = Clock::now();
    for (int i = 0; i < steps; ++i) {
      value *= 0x9e3779b97f4a7c15u;
#if defined(__GNUC__)
      __asm__ volatile("" : "+r"(value));
#endif
    }
    best = std::min(best, ns_since(start) / steps);
  }
  return value == 0 ? 0 : best;
}

/// Functions that are timed alternately.
class Bench {
 public:
  void add(std::string name, double items, std::function<void()> work) {
    rows_.push_back({std::move(name), items, std::move(work), {}});
  }

  void run(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      for (Row& row : rows_) {
        row.work();  // into the caches
        for (int repeat = 0; repeat < 4; ++repeat) {
          const auto start = Clock::now();
          row.work();
          row.ns.push_back(ns_since(start) / row.items);
        }
      }
    }
  }

  /// The lines of a JSON object, without its braces.
  void print(const char* prefix) {
    for (Row& row : rows_) {
      std::sort(row.ns.begin(), row.ns.end());
      const auto at = [&](double share) {
        return row.ns[static_cast<std::size_t>(share * static_cast<double>(row.ns.size() - 1))];
      };
      std::printf("  \"%s%s\": {\"min\": %.4f, \"p10\": %.4f, \"median\": %.4f},\n", prefix, row.name.c_str(), at(0),
                  at(0.1), at(0.5));
    }
  }

 private:
  struct Row {
    std::string name;
    double items;
    std::function<void()> work;
    std::vector<double> ns;
  };
  std::vector<Row> rows_;
};
