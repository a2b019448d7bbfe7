// SPDX-License-Identifier: MIT
#pragma once

// Arrays that start with a cache line: a SIMD register that is loaded from two lines takes twice as long.

#include <new>
#include <vector>

template <class Item>
struct CacheLines {
  using value_type = Item;
  static constexpr std::align_val_t line{64};

  CacheLines() = default;
  template <class Other>
  CacheLines(const CacheLines<Other>&) {}
  Item* allocate(std::size_t size) { return static_cast<Item*>(::operator new(size * sizeof(Item), line)); }
  void deallocate(Item* items, std::size_t) { ::operator delete(items, line); }
  bool operator==(const CacheLines&) const { return true; }
  bool operator!=(const CacheLines&) const { return false; }
};

template <class Item>
using LineVector = std::vector<Item, CacheLines<Item>>;
