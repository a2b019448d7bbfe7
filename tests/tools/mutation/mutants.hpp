// SPDX-License-Identifier: MIT
#pragma once

// Every operator of the core becomes one of these; the one with the number in PALPATE_MUTANT does the opposite. So one
// build has all mutants. In constant expressions no mutant is active.

#include <cstdlib>

namespace mutants {

inline const int chosen = std::getenv("PALPATE_MUTANT") ? std::atoi(std::getenv("PALPATE_MUTANT")) : -1;

constexpr bool on(int number) { return !__builtin_is_constant_evaluated() && number == chosen; }

#define PALPATE_MUTANT(name, written, flipped)              \
  template <class A, class B>                               \
  constexpr auto name(int number, const A& a, const B& b) { \
    return on(number) ? a flipped b : a written b;          \
  }
PALPATE_MUTANT(plus, +, -)
PALPATE_MUTANT(minus, -, +)
PALPATE_MUTANT(times, *, /)
PALPATE_MUTANT(over, /, *)
PALPATE_MUTANT(less, <, >=)
PALPATE_MUTANT(greater, >, <=)
PALPATE_MUTANT(less_equal, <=, >)
PALPATE_MUTANT(greater_equal, >=, <)
PALPATE_MUTANT(equal, ==, !=)
PALPATE_MUTANT(unequal, !=, ==)

}  // namespace mutants
