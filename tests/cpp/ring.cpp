// SPDX-License-Identifier: MIT
// Two threads and a small ring: what arrives is in order and whole, and what does not is counted. Built again with
// ThreadSanitizer, which sees a missing release or acquire where the processor forgives it.

#include <cstdint>
#include <cstdio>
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

template <class Push, class Pop>
bool run(const char* name, std::uint64_t total, Push push, Pop pop) {
  palpate::Ring<Item, 64> ring;
  Result result;
  std::atomic<bool> done{false};
  std::thread producer([&] {
    int pushes = 0;
    for (std::uint64_t n = 1; n <= total;) {
      n = push(ring, n, total);
      // Now and then the other thread has its turn: otherwise all can be over before it begins.
      for (++pushes; pushes % 4096 == 0 && ring.size() > 0;) {
        std::this_thread::yield();
      }
    }
    done.store(true, std::memory_order_release);
  });
  for (;;) {
    const bool last = done.load(std::memory_order_acquire);
    if (pop(ring, result)) {
      continue;
    }
    if (last) {
      break;
    }
    std::this_thread::yield();
  }
  producer.join();
  const bool counted = result.received + ring.dropped() == total;
  const bool first = ring.dropped() == 0 || ring.first_dropped() <= result.received;
  std::printf("%s: %d received, %d dropped\n", name, static_cast<int>(result.received),
              static_cast<int>(ring.dropped()));
  return result.whole && result.ordered && counted && first && ring.size() == 0;
}

std::uint64_t push_one(palpate::Ring<Item, 64>& ring, std::uint64_t n, std::uint64_t) {
  ring.try_push(item(n));
  return n + 1;
}

std::uint64_t push_some(palpate::Ring<Item, 64>& ring, std::uint64_t n, std::uint64_t total) {
  Item items[7];
  std::size_t count = 0;
  while (count < 7 && n <= total) {
    items[count++] = item(n++);
  }
  ring.push(items, count);
  return n;
}

bool pop_one(palpate::Ring<Item, 64>& ring, Result& result) {
  Item taken;
  const bool some = ring.try_pop(taken);
  if (some) {
    result.take(taken);
  }
  return some;
}

bool pop_some(palpate::Ring<Item, 64>& ring, Result& result) {
  Item taken[11];
  const std::size_t count = ring.pop(taken, 11);
  for (std::size_t i = 0; i < count; ++i) {
    result.take(taken[i]);
  }
  return count > 0;
}

}  // namespace

int main() {
  constexpr std::uint64_t total = 300000;
  const bool singly = run("one by one", total, push_one, pop_one);
  const bool blocks = run("in blocks", total, push_some, pop_some);
  const bool mixed = run("mixed", total, push_one, pop_some);
  return singly && blocks && mixed ? 0 : 1;
}
