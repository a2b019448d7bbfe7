// SPDX-License-Identifier: MIT
#pragma once
#pragma GCC system_header  // no warnings

// Every operator and constant of the headers becomes a call of one of these. The one with the number in PALPATE_MUTANT
// does something else at run time; with -DPALPATE_MUTANT=number also in constant expressions. The file PALPATE_EXECUTED
// gets a byte for each one that was executed.

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <type_traits>
#include <utility>

#ifndef PALPATE_MUTANT
#define PALPATE_MUTANT -1
#endif

namespace mutants {

inline int chosen = -1;
inline char* executed = nullptr;

struct Environment {
  Environment() {
    if (const char* number = std::getenv("PALPATE_MUTANT")) chosen = std::atoi(number);
    if (const char* name = std::getenv("PALPATE_EXECUTED")) {
      const int file = open(name, O_RDWR);
      void* const bytes = mmap(nullptr, 1 << 16, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
      if (bytes != MAP_FAILED) executed = static_cast<char*>(bytes);
      close(file);
    }
  }
};
inline const Environment environment;

constexpr bool on(int number) noexcept {
  if (__builtin_is_constant_evaluated()) return number == PALPATE_MUTANT;
  if (executed) executed[number] = 1;
  return number == chosen || number == PALPATE_MUTANT;
}

template <class T>
constexpr T nudged(int number, T value) noexcept {
  if (!on(number)) return value;
  return value == T(0) ? T(1) : std::is_integral_v<T> ? T(value + T(1)) : T(value * T(1.1));
}

/// A number that is combined with a vector, in the type of its elements.
template <class A, class B>
constexpr auto with(const A&, const B& b) noexcept {
  constexpr bool is_vector = !std::is_scalar_v<A> && !std::is_class_v<A> && !std::is_array_v<A>;
  if constexpr (is_vector && std::is_arithmetic_v<B>)
    return static_cast<std::decay_t<decltype(std::declval<A>()[0])>>(b);
  else
    return b;
}

/// The mutant of an operator of classes that have no flipped one: the opposite of a comparison, or the left side.
template <class A, class Result>
constexpr Result unflipped(const A& a, const Result& right) noexcept {
  if constexpr (std::is_same_v<Result, bool>)
    return !right;
  else
    return a;
}

#define PALPATE_FLIPPED(name, written, flipped)                                                                        \
  template <class A, class B, class = void>                                                                            \
  inline constexpr bool name##_flips = !std::is_class_v<A>;                                                            \
  template <class A, class B>                                                                                          \
  inline constexpr bool name##_flips<A, B, std::void_t<decltype(std::declval<A>() flipped std::declval<B>())>> = true; \
  template <class A, class B>                                                                                          \
  constexpr auto name(int number, const A& a, const B& b) noexcept {                                                   \
    if constexpr (name##_flips<A, B>)                                                                                  \
      return on(number) ? with(b, a) flipped with(a, b) : with(b, a) written with(a, b);                               \
    else                                                                                                               \
      return on(number) ? unflipped(a, a written b) : a written b;                                                     \
  }
PALPATE_FLIPPED(plus, +, -)
PALPATE_FLIPPED(minus, -, +)
PALPATE_FLIPPED(times, *, /)
PALPATE_FLIPPED(over, /, *)
PALPATE_FLIPPED(less, <, >=)
PALPATE_FLIPPED(greater, >, <=)
PALPATE_FLIPPED(less_equal, <=, >)
PALPATE_FLIPPED(greater_equal, >=, <)
PALPATE_FLIPPED(equal, ==, !=)
PALPATE_FLIPPED(unequal, !=, ==)

#define PALPATE_ASSIGNED(name, written, flipped)                     \
  template <class A, class B>                                        \
  constexpr A& name(int number, A& a, const B& b) noexcept {         \
    return on(number) ? a flipped with(a, b) : a written with(a, b); \
  }
PALPATE_ASSIGNED(add, +=, -=)
PALPATE_ASSIGNED(subtract, -=, +=)

}  // namespace mutants
