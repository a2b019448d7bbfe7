// SPDX-License-Identifier: MIT
#pragma once

#include <vector>

#include "../runs/run.hpp"
#include "module.hpp"

using TouchResult = palpate::runs::Result;

/// The touches that have ended, and the numbers, from 1, of those that were revised, in order of time. Only the last one
/// can be revised: before the next one begins, or never.
struct Touches {
  std::vector<TouchResult> list;
  std::vector<std::size_t> revisions;

  void end(const palpate::runs::Result& touch) { list.push_back(touch); }
  void revise(const palpate::runs::Result& touch) {
    (list.empty() ? before : list).back() = touch;
    revisions.push_back(number + list.size());
  }

  /// Those of a block: how many there were before, and a place for the last one of them.
  static Touches after(const Touches& all) {
    Touches block;
    block.number = all.list.size();
    block.before.assign(all.list.end() - (all.list.empty() ? 0 : 1), all.list.end());
    return block;
  }
  void append(const Touches& block) {
    if (!block.before.empty()) {
      list.back() = block.before.back();
    }
    list.insert(list.end(), block.list.begin(), block.list.end());
    revisions.insert(revisions.end(), block.revisions.begin(), block.revisions.end());
  }
  std::size_t count() const { return number + list.size(); }

 private:
  std::vector<TouchResult> before;
  std::size_t number = 0;
};
