// SPDX-License-Identifier: MIT
// The results on a Cortex-M, and the costs of each subject there: instructions for each reading, mean and maximum, and
// bytes of stack.

#include <initializer_list>

#include "readings.hpp"
#include "subjects.hpp"

#if !defined(REPEATS)
#define REPEATS 100
#endif

namespace {

// The clock of the processor; with -icount shift=0 of QEMU, one tick is a fixed number of instructions.
volatile std::uint32_t& control = *reinterpret_cast<volatile std::uint32_t*>(0xE000E010);
volatile std::uint32_t& reload = *reinterpret_cast<volatile std::uint32_t*>(0xE000E014);
volatile std::uint32_t& current = *reinterpret_cast<volatile std::uint32_t*>(0xE000E018);

// The same call of a function that only returns.
template <class Result, class... Values>
[[gnu::naked]] Result nothing(Values...) {
  __asm__("bx lr");
}

template <class Subject>
struct Meter {
  using Entry = subjects::Entry<Subject>;
  using Function = typename Entry::Function;
  using State = typename Subject::State;

  /// Ticks for REPEATS times the same reading from the same state.
  [[gnu::noipa]] static std::uint32_t ticks(Function* function, const State& before, const Reading& reading) {
    State state = before;
    const std::uint32_t start = current;
    for (int i = 0; i < REPEATS; ++i) {
      state = before;
      __asm__ volatile("" ::"r"(&state) : "memory");
      Subject::with(function, state, reading);
    }
    return (start - current) & 0xFFFFFF;
  }

  /// Number of bytes below the frame of this function that a call writes to.
  [[gnu::noipa]] static std::uint32_t stack(Function* function, State state, const Reading& reading) {
    constexpr std::uint32_t paint = 0xA5A5A5A5, words = 256;
    std::uint32_t* top = nullptr;
    __asm__ volatile("mov %0, sp" : "=r"(top));
    volatile std::uint32_t* const bottom = top - words;
    for (std::uint32_t i = 0; i < words; ++i) {
      bottom[i] = paint;
    }
    Subject::with(function, state, reading);
    std::uint32_t untouched = 0;
    while (untouched < words && bottom[untouched] == paint) {
      ++untouched;
    }
    return 4 * (words - untouched);
  }
};

template <class Result, class... Values>
auto nothing_like(Result (*)(Values...)) {
  return nothing<Result, Values...>;
}

/// Prints a line: cost NAME, number of readings, ticks of all, ticks and index of the most expensive reading of a
/// touch, ticks of the most expensive other one, stack, state.
template <class Subject>
void measure(const char* name) {
  using M = Meter<Subject>;
  typename M::State state;
  Readings readings;
  std::uint32_t count = 0, sum = 0, worst = 0, dearest = 0, idle = 0, stack = 0;
  for (int i = 0; i < Readings::size; ++i) {
    const Reading reading = readings.next();
    if (!subjects::accepts<Subject>(reading)) {
      continue;
    }
    const auto feed = M::Entry::feed;
    const std::uint32_t ticks = M::ticks(feed, state, reading) - M::ticks(nothing_like(feed), state, reading);
    const std::uint32_t bytes = M::stack(feed, state, reading);
    Subject::with(feed, state, reading);
    count += 1;
    sum += ticks;
    stack = bytes > stack ? bytes : stack;
    if (!Readings::touched(i)) {
      idle = ticks > idle ? ticks : idle;
    } else if (ticks > worst) {
      worst = ticks;
      dearest = static_cast<std::uint32_t>(i);
    }
  }
  put("cost ");
  put(name);
  for (const std::uint32_t value :
       {count, sum, worst, dearest, idle, stack, std::uint32_t{sizeof(typename M::State)}}) {
    put(" ");
    put_number(value);
  }
  put("\n");
}

}  // namespace

void run() {
  print_results();
  reload = 0xFFFFFF;
  current = 0;
  control = 5;  // on, from the processor's clock, without interrupt
  const auto cost = [](const char* name, auto subject) { measure<decltype(subject)>(name); };
  subjects::for_each(cost);
  subjects::for_each_window(cost);
}
