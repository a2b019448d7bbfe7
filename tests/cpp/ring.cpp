// SPDX-License-Identifier: MIT
// Two threads and a small ring: what arrives is in order and whole, and what does not is counted. Built again with
// ThreadSanitizer, which sees a missing release or acquire where the processor forgives it.

#include <cstdint>
#include <palpate/ring.hpp>
#include <thread>

namespace {

struct Item {
  std::uint64_t number, twice, square;
};

constexpr Item item(std::uint64_t n) { return {n, 2 * n, n * n}; }

struct Result {
  std::uint64_t received = 0, last = 0;
  bool whole = true, ordered = true;

  void take(const Item& i) {
    whole = whole && i.twice == 2 * i.number && i.square == i.number * i.number;
    ordered = ordered && i.number > last;
    last = i.number;
    ++received;
  }
};

bool run(std::uint64_t total) {
  palpate::Ring<Item, 64> ring;
  Result result;
  std::atomic<bool> done{false};
  std::thread producer([&] {
    Item items[7];
    for (std::uint64_t n = 1; n + 7 <= total;) {
      ring.try_push(item(n++));
      for (Item& one : items) {
        one = item(n++);
      }
      ring.push(items, 7);
      // Now and then the other thread has its turn: otherwise all can be over before it begins.
      while (n % 4096 < 8 && ring.size() > 0) {
        std::this_thread::yield();
      }
    }
    done.store(true, std::memory_order_release);
  });
  for (bool last = false; !last || ring.size() > 0;) {
    last = done.load(std::memory_order_acquire);
    Item taken[11];
    const std::size_t count = ring.try_pop(taken[0]) ? 1 + ring.pop(taken + 1, 10) : 0;
    for (std::size_t i = 0; i < count; ++i) {
      result.take(taken[i]);
    }
    if (count == 0) {
      std::this_thread::yield();
    }
  }
  producer.join();
  const bool counted = result.received + ring.dropped() == total / 8 * 8;
  const bool first = ring.dropped() == 0 || ring.first_dropped() <= result.received;
  return result.whole && result.ordered && counted && first;
}

}  // namespace

int main() { return run(600000) ? 0 : 1; }
