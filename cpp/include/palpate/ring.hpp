// SPDX-License-Identifier: MIT
#pragma once

// From one producer to one consumer, without locks: an interrupt or a reader thread pushes, the estimating loop pops.

#include <atomic>
#include <cstddef>
#include <palpate/arithmetic.hpp>
#include <type_traits>

namespace palpate {

/// Storage of a Ring inside the object. Another one offers the same two functions; its capacity is a power of two, too.
template <class Item, std::size_t Capacity>
class FixedStorage {
  static_assert(Capacity >= 2 && (Capacity & (Capacity - 1)) == 0, "palpate::Ring: Capacity must be a power of two");

 public:
  using item_type = Item;
  static constexpr std::size_t capacity() noexcept { return Capacity; }
  constexpr Item* items() noexcept { return items_; }

 private:
  Item items_[Capacity] = {};
};

/// Where the two sides run on processors with caches, what each of them writes lies in a line of its own.
inline constexpr std::size_t ring_alignment = sizeof(void*) < 8 ? alignof(std::atomic<std::size_t>) : 64;

/// A queue of fixed capacity. When it is full the newest items are dropped and counted: what is inside stays in order.
/// push and try_push belong to one thread, pop and try_pop to one other; the rest may be asked from anywhere.
/// Positions count every item ever accepted and wrap with std::size_t. Each side keeps a copy of the other's position
/// and asks for the real one only when that copy says full, or empty (E. Rigtorp's SPSCQueue).
template <class Storage>
class BasicRing : Storage {
 public:
  using Item = typename Storage::item_type;
  static_assert(std::is_trivially_copyable_v<Item>, "palpate::Ring: Item must be trivially copyable");

  constexpr BasicRing() noexcept = default;
  explicit BasicRing(Storage&& storage) noexcept : Storage(static_cast<Storage&&>(storage)) {}
  BasicRing(const BasicRing&) = delete;
  BasicRing& operator=(const BasicRing&) = delete;

  bool try_push(const Item& item) noexcept {
    const std::size_t position = producer_.position.load(std::memory_order_relaxed);
    if (space(position, 1) == 0) {
      drop(position, 1);
      return false;
    }
    Storage::items()[position & (capacity() - 1)] = item;
    producer_.position.store(position + 1, std::memory_order_release);
    return true;
  }

  /// Push up to `count` items and return how many were accepted: the first ones. The others are counted as dropped.
  std::size_t push(const Item* items, std::size_t count) noexcept {
    const std::size_t position = producer_.position.load(std::memory_order_relaxed);
    const std::size_t accepted = space(position, count);
    const std::size_t run = run_of(position, accepted);
    copy(Storage::items() + (position & (capacity() - 1)), items, run);
    copy(Storage::items(), items + run, accepted - run);
    producer_.position.store(position + accepted, std::memory_order_release);
    if (accepted < count) {
      drop(position + accepted, count - accepted);
    }
    return accepted;
  }

  bool try_pop(Item& item) noexcept {
    const std::size_t position = consumer_.position.load(std::memory_order_relaxed);
    if (there(position, 1) == 0) {
      return false;
    }
    item = Storage::items()[position & (capacity() - 1)];
    consumer_.position.store(position + 1, std::memory_order_release);
    return true;
  }

  /// Pop up to `count` items, the oldest first, and return how many there were.
  std::size_t pop(Item* items, std::size_t count) noexcept {
    const std::size_t position = consumer_.position.load(std::memory_order_relaxed);
    const std::size_t taken = there(position, count);
    const std::size_t run = run_of(position, taken);
    copy(items, Storage::items() + (position & (capacity() - 1)), run);
    copy(items + run, Storage::items(), taken - run);
    consumer_.position.store(position + taken, std::memory_order_release);
    return taken;
  }

  /// Items inside: exact for either of the two sides as far as its own calls go, a moment's view for others.
  std::size_t size() const noexcept {
    const std::size_t consumed = consumer_.position.load(std::memory_order_acquire);
    return producer_.position.load(std::memory_order_acquire) - consumed;
  }
  constexpr std::size_t capacity() const noexcept { return Storage::capacity(); }

  /// How many items were dropped because the ring was full.
  std::size_t dropped() const noexcept { return dropped_.load(std::memory_order_acquire); }
  /// How many items had been accepted when the first one was dropped; means nothing while dropped() is 0.
  std::size_t first_dropped() const noexcept { return first_dropped_.load(std::memory_order_relaxed); }

 private:
  struct alignas(ring_alignment) Side {
    std::atomic<std::size_t> position{0};
    std::size_t other = 0;  // the other side's position when it was last asked for
  };

  // Room for how many of `count` items, and how many of `count` are there: as far as this side must know.
  std::size_t space(std::size_t position, std::size_t count) noexcept {
    if (capacity() - (position - producer_.other) < count) {
      producer_.other = consumer_.position.load(std::memory_order_acquire);
    }
    const std::size_t free = capacity() - (position - producer_.other);
    return count < free ? count : free;
  }
  std::size_t there(std::size_t position, std::size_t count) noexcept {
    if (consumer_.other - position < count) {
      consumer_.other = producer_.position.load(std::memory_order_acquire);
    }
    const std::size_t inside = consumer_.other - position;
    return count < inside ? count : inside;
  }

  // How many of `count` items lie before the end of the storage.
  std::size_t run_of(std::size_t position, std::size_t count) const noexcept {
    const std::size_t to_end = capacity() - (position & (capacity() - 1));
    return count < to_end ? count : to_end;
  }

  static void copy(Item* PALPATE_RESTRICT to, const Item* PALPATE_RESTRICT from, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = from[i];
    }
  }

  void drop(std::size_t position, std::size_t count) noexcept {
    const std::size_t before = dropped_.load(std::memory_order_relaxed);
    if (before == 0) {
      first_dropped_.store(position, std::memory_order_relaxed);
    }
    dropped_.store(before + count, std::memory_order_release);
  }

  Side producer_, consumer_;
  alignas(ring_alignment) std::atomic<std::size_t> dropped_{0};
  std::atomic<std::size_t> first_dropped_{0};
};

/// Ring<Item, 256>: no heap; on a microcontroller 24 bytes besides the items.
template <class Item, std::size_t Capacity>
using Ring = BasicRing<FixedStorage<Item, Capacity>>;

}  // namespace palpate
