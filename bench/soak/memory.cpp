// SPDX-License-Identifier: MIT
// Samples through the ring and the tracker, from one thread to another, for a very long time: the memory must not
// grow. Prints JSON: the resident set at the start, at each quarter and at the end, and the counts. The argument is the
// number of samples.

#include <array>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <palpate/palpate.hpp>
#include <palpate/ring.hpp>
#include <thread>

namespace {

struct Pair {
  std::int64_t t_hard, t_soft;
  double hard, soft;
};

// A press of 200 samples in every 400, with noise of about 1e-5 pF, 26 ms from pair to pair.
Pair pair(std::uint64_t i) {
  const auto t = static_cast<std::int64_t>(i) * 26000000;
  const double press = i % 400 < 200 ? 0.25 : 0.0;
  const double noise = static_cast<double>(i * 2654435761u % 1024) * 1e-8;
  return {t, t + 13000000, 0.5 + 2.5 * press + noise, 0.25 + press - noise};
}

long resident_kb() {
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> file(std::fopen("/proc/self/statm", "r"), &std::fclose);
  long size = 0, pages = 0;
  return file && std::fscanf(file.get(), "%ld %ld", &size, &pages) == 2 ? pages * 4 : -1;
}

}  // namespace

int main(int argc, char** argv) {
  const std::uint64_t samples = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 1000000000;
  const auto ring = std::make_unique<palpate::Ring<Pair, 1024>>();
  palpate::HandheldTracker<double> tracker;
  std::thread source([&] {
    std::array<Pair, 64> ready{};
    for (std::uint64_t i = 0; i < samples;) {
      std::size_t count = 0;
      while (count < ready.size() && i < samples) {
        ready[count++] = pair(i++);
      }
      while (ring->size() + count > 1024) {  // one producer: free places stay free
        std::this_thread::yield();
      }
      ring->push(ready.data(), count);
    }
  });
  std::array<Pair, 256> taken{};
  std::uint64_t received = 0, touches = 0;
  std::array<long, 5> resident{};
  while (received < samples) {
    const std::size_t count = ring->pop(taken.data(), taken.size());
    for (std::size_t i = 0; i < count; ++i) {
      touches += tracker.feed(taken[i].t_hard, taken[i].t_soft, taken[i].hard, taken[i].soft).finished;
    }
    if (count == 0) {
      std::this_thread::yield();
    }
    const std::uint64_t quarter = 4 * received / samples;
    received += count;
    if (received == count || quarter != 4 * received / samples) {
      resident[4 * received / samples] = resident_kb();
    }
  }
  source.join();
  std::printf("{\"samples\": %llu, \"dropped\": %llu, \"touches\": %llu, \"ratio\": %.6f, \"resident_kB\": ",
              static_cast<unsigned long long>(received), static_cast<unsigned long long>(ring->dropped()),
              static_cast<unsigned long long>(touches), tracker.touch().ratio);
  std::printf("[%ld, %ld, %ld, %ld, %ld]}\n", resident[0], resident[1], resident[2], resident[3], resident[4]);
}
