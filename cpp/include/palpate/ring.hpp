// SPDX-License-Identifier: MIT
#pragma once

// A queue from one producer to one consumer, without locks: an interrupt or a thread pushes, the estimating loop pops.

#include <atomic>
#include <palpate/arithmetic.hpp>

namespace palpate {
inline namespace PALPATE_NAMESPACE {

/// Storage of a Ring inside the object. Other storages have the same two functions; their capacity is a power of two.
template <class Item, std::size_t Capacity>
class FixedStorage {
  static_assert(Capacity >= 2 && (Capacity & (Capacity - 1)) == 0, "palpate::Ring: Capacity must be a power of two");

 public:
  using item_type = Item;  ///< of the ring
  /// Number of places.
  static constexpr std::size_t capacity() noexcept { return Capacity; }
  /// The first place.
  constexpr Item* items() noexcept { return items_; }

 private:
  Item items_[Capacity] = {};
};

/// On processors with caches each side writes to its own cache line.
inline constexpr std::size_t ring_alignment = sizeof(void*) < 8 ? alignof(std::atomic<std::size_t>) : 64;

/// A queue of fixed capacity. If it is full, new items are dropped and counted: the items inside stay in order.
/// Only one thread may call push and try_push, and only one pop and try_pop; all others may be called from any thread.
/// Positions count all accepted items and wrap with std::size_t. Each side keeps a copy of the other side's position,
/// and reads the real one only if the ring is full, or empty, according to the copy (as SPSCQueue of E. Rigtorp).
template <class Storage>
class BasicRing : Storage {
 public:
  using Item = typename Storage::item_type;  ///< trivially copyable
  static_assert(std::is_trivially_copyable_v<Item>, "palpate::Ring: Item must be trivially copyable");

  /// An empty ring.
  constexpr BasicRing() noexcept = default;
  /// In a storage of your own.
  explicit BasicRing(Storage&& storage) noexcept : Storage(static_cast<Storage&&>(storage)) {}
  BasicRing(const BasicRing&) = delete;
  BasicRing& operator=(const BasicRing&) = delete;

  /// Push an item; false: the ring is full, the item is dropped and counted.
  bool try_push(const Item& item) noexcept { return push(&item, 1) == 1; }

  /// Push up to `count` items and return the number of accepted items, the first ones; the others are dropped, counted.
  std::size_t push(const Item* items, std::size_t count) noexcept {
    const std::size_t position = producer_.position.load(std::memory_order_relaxed);
    const std::size_t accepted = reach(producer_, consumer_, capacity(), position, count);
    const std::size_t run = run_of(position, accepted);
    copy(Storage::items() + (position & (capacity() - 1)), items, run);
    copy(Storage::items(), items + run, accepted - run);
    producer_.position.store(position + accepted, std::memory_order_release);
    if (accepted < count) {
      const std::size_t before = dropped_.load(std::memory_order_relaxed);
      if (before == 0) {
        first_dropped_.store(position + accepted, std::memory_order_relaxed);
      }
      dropped_.store(before + (count - accepted), std::memory_order_release);
    }
    return accepted;
  }

  /// Pop the oldest item; false: there is none.
  bool try_pop(Item& item) noexcept { return pop(&item, 1) == 1; }

  /// Pop up to `count` items, the oldest first, and return their number.
  std::size_t pop(Item* items, std::size_t count) noexcept {
    const std::size_t position = consumer_.position.load(std::memory_order_relaxed);
    const std::size_t taken = reach(consumer_, producer_, 0, position, count);
    const std::size_t run = run_of(position, taken);
    copy(items, Storage::items() + (position & (capacity() - 1)), run);
    copy(items + run, Storage::items(), taken - run);
    consumer_.position.store(position + taken, std::memory_order_release);
    return taken;
  }

  /// Number of items inside. Another thread may change it at any time; own calls are always included.
  std::size_t size() const noexcept {
    const std::size_t consumed = consumer_.position.load(std::memory_order_acquire);
    return producer_.position.load(std::memory_order_acquire) - consumed;
  }
  /// Number of items that it holds at most.
  constexpr std::size_t capacity() const noexcept { return Storage::capacity(); }

  /// Number of items that were dropped because the ring was full.
  std::size_t dropped() const noexcept { return dropped_.load(std::memory_order_acquire); }
  /// Number of items accepted before the first one was dropped; valid only if dropped() is not 0.
  std::size_t first_dropped() const noexcept { return first_dropped_.load(std::memory_order_relaxed); }

 private:
  struct alignas(ring_alignment) Side {
    std::atomic<std::size_t> position{0};
    std::size_t other = 0;  // position of the other side when it was last read
  };

  // Number of places from `position` up to the other side's position and `ahead` more, at most `count`. That position is
  // read only if necessary.
  static std::size_t reach(Side& own, const Side& other, std::size_t ahead, std::size_t position,
                           std::size_t count) noexcept {
    if (own.other + ahead - position < count) {
      own.other = other.position.load(std::memory_order_acquire);
    }
    const std::size_t there = own.other + ahead - position;
    return count < there ? count : there;
  }

  // Number of the `count` items before the end of the storage.
  std::size_t run_of(std::size_t position, std::size_t count) const noexcept {
    const std::size_t to_end = capacity() - (position & (capacity() - 1));
    return count < to_end ? count : to_end;
  }

  static void copy(Item* to, const Item* from, std::size_t count) noexcept {
    for (std::size_t i = 0; i < count; ++i) {
      to[i] = from[i];
    }
  }

  Side producer_, consumer_;
  alignas(ring_alignment) std::atomic<std::size_t> dropped_{0};
  std::atomic<std::size_t> first_dropped_{0};
};

/// A queue inside the object, for example Ring<float, 256>: no heap; on a microcontroller 24 bytes besides the items.
template <class Item, std::size_t Capacity>
using Ring = BasicRing<FixedStorage<Item, Capacity>>;

}  // namespace PALPATE_NAMESPACE
}  // namespace palpate
