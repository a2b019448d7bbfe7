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

/// Timings of one function, ns an item.
struct Timings {
  std::vector<double> ns;

  double at(double share) {
    std::sort(ns.begin(), ns.end());
    return ns[static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1))];
  }
  /// A line of a JSON object.
  void print(const std::string& name) {
    std::printf("  \"%s\": {\"min\": %.4f, \"p10\": %.4f, \"median\": %.4f},\n", name.c_str(), at(0), at(0.1), at(0.5));
  }
};

/// Functions that are timed alternately.
///
/// A branch predictor learns thousands of samples by heart. So a function with `renew` gets data that no loop has seen,
/// from the cache: the first pass over them is its time, and the later half of the passes is a row of its own.
class Bench {
 public:
  static constexpr int passes = 8;

  void add(std::string name, double items, std::function<void()> work, std::function<void()> renew = nullptr) {
    rows_.push_back({std::move(name), items, std::move(work), std::move(renew), {}, {}});
  }

  void run(int rounds) {
    for (int round = 0; round < rounds; ++round) {
      for (Row& row : rows_) {
        row.work();  // the code into the caches
        if (row.renew) {
          row.renew();
        }
        for (int pass = 0; pass < passes; ++pass) {
          const auto start = Clock::now();
          row.work();
          const double ns = ns_since(start) / row.items;
          if (!row.renew || pass == 0) {
            row.first.ns.push_back(ns);
          } else if (pass >= passes / 2) {
            row.again.ns.push_back(ns);
          }
        }
      }
    }
  }

  /// The lines of a JSON object, without its braces.
  void print(const std::string& prefix) {
    for (Row& row : rows_) {
      row.first.print(prefix + row.name);
      if (row.renew) {
        row.again.print(prefix + row.name + ", again");
      }
    }
  }

 private:
  struct Row {
    std::string name;
    double items;
    std::function<void()> work, renew;
    Timings first, again;
  };
  std::vector<Row> rows_;
};
