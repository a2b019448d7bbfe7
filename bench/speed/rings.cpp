// SPDX-License-Identifier: MIT
// The ring in comparison with a queue with a mutex and with two flags only, on two threads. Prints JSON.

#include <atomic>
#include <cstdlib>
#include <deque>
#include <iterator>
#include <mutex>
#include <palpate/ring.hpp>
#include <thread>

#include "timing.hpp"

namespace {

struct Item {
  std::uint64_t number, value;
};

struct MutexQueue {
  std::mutex mutex;
  std::deque<Item> items;

  bool try_push(const Item& item) {
    const std::lock_guard<std::mutex> lock(mutex);
    items.push_back(item);
    return true;
  }
  bool try_pop(Item& item) {
    const std::lock_guard<std::mutex> lock(mutex);
    if (items.empty()) {
      return false;
    }
    item = items.front();
    items.pop_front();
    return true;
  }
};

/// Two places for one item each, and two flags: the lower limit for a round trip.
struct Flags {
  alignas(64) std::atomic<bool> full{false};
  Item item{};

  bool try_push(const Item& i) {
    if (full.load(std::memory_order_acquire)) {
      return false;
    }
    item = i;
    full.store(true, std::memory_order_release);
    return true;
  }
  bool try_pop(Item& i) {
    if (!full.load(std::memory_order_acquire)) {
      return false;
    }
    i = item;
    full.store(false, std::memory_order_release);
    return true;
  }
};

using Ring = palpate::Ring<Item, 1024>;
/// One thread pushes, the other pops, as fast as possible: ns for each item.
template <class Queue>
double stream(std::uint64_t items) {
  Queue queue;
  const auto start = Clock::now();
  std::thread producer([&] {
    for (std::uint64_t i = 0; i < items; ++i) {
      while (!queue.try_push({i, i})) {
      }
    }
  });
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < items; ++i) {
    Item item{};
    while (!queue.try_pop(item)) {
    }
    sum += item.value;
  }
  producer.join();
  const double ns = ns_since(start) / static_cast<double>(items);
  return sum == items * (items - 1) / 2 ? ns : -1;  // every item, once
}

/// Push one, pop one, on one thread: ns for each pair.
template <class Queue>
double pairs(std::uint64_t items) {
  Queue queue;
  const auto start = Clock::now();
  std::uint64_t sum = 0;
  for (std::uint64_t i = 0; i < items; ++i) {
    Item item{};
    queue.try_push({i, i});
    queue.try_pop(item);
    sum += item.value;
  }
  const double ns = ns_since(start) / static_cast<double>(items);
  return sum == items * (items - 1) / 2 ? ns : -1;
}

/// Round trips between two threads: the times of all trips, ns, sorted.
template <class Queue>
std::vector<double> round_trips(int trips) {
  Queue there, back;
  std::thread echo([&] {
    Item item;
    for (int i = 0; i < trips; ++i) {
      while (!there.try_pop(item)) {
      }
      while (!back.try_push(item)) {
      }
    }
  });
  std::vector<double> ns;
  Item item;
  for (int i = 0; i < trips; ++i) {
    const auto start = Clock::now();
    while (!there.try_push({static_cast<std::uint64_t>(i), 0})) {
    }
    while (!back.try_pop(item)) {
    }
    ns.push_back(ns_since(start));
  }
  echo.join();
  std::sort(ns.begin(), ns.end());
  return ns;
}

template <class Queue>
double round_trip(std::uint64_t trips) {
  return round_trips<Queue>(static_cast<int>(trips))[trips / 2];
}

struct Row {
  const char* name;
  double (*work)(std::uint64_t);
  std::uint64_t items;
  std::vector<double> ns;
};

}  // namespace

int main(int argc, char** argv) {
  const int rounds = argc > 1 ? std::atoi(argv[1]) : 30;
  Row rows[] = {{"ring, push and pop on one thread", pairs<Ring>, 100000, {}},
                {"mutex queue, push and pop on one thread", pairs<MutexQueue>, 100000, {}},
                {"ring, item from thread to thread", stream<Ring>, 200000, {}},
                {"mutex queue, item from thread to thread", stream<MutexQueue>, 50000, {}},
                {"ring, round trip", round_trip<Ring>, 5000, {}},
                {"two flags, round trip", round_trip<Flags>, 5000, {}},
                {"mutex queue, round trip", round_trip<MutexQueue>, 500, {}}};
  for (int i = 0; i < rounds; ++i) {
    for (Row& row : rows) {
      row.ns.push_back(row.work(row.items));
    }
  }
  std::printf("{\n");
  for (Row& row : rows) {
    std::sort(row.ns.begin(), row.ns.end());
    std::printf("  \"%s\": {\"min\": %.3f, \"p10\": %.3f, \"median\": %.3f}%s\n", row.name, row.ns.front(),
                row.ns[row.ns.size() / 10], row.ns[row.ns.size() / 2], &row == std::end(rows) - 1 ? "" : ",");
  }
  std::printf("}\n");
}
