// SPDX-License-Identifier: MIT
#include <initializer_list>

#include "readings.hpp"
#include "subjects.hpp"

namespace {

std::uint32_t bits(float value) {
  std::uint32_t result = 0;
  __builtin_memcpy(&result, &value, sizeof value);
  return result;
}

struct Hash {
  std::uint64_t value = 14695981039346656037u;
  void add(std::uint32_t word) { value = (value ^ word) * 1099511628211u; }
  void add(float number) { add(bits(number)); }
  void add(bool flag) { add(std::uint32_t{flag}); }
};

// The public numbers of a state.
template <class Estimator>
auto add_state(Hash& hash, const Estimator& e, const void*) -> decltype(e.information(), void()) {
  hash.add(e.ratio());
  hash.add(e.information());
  hash.add(e.statistic());
}
template <class Scene>
auto add_state(Hash& hash, const Scene& scene, const void* any) -> decltype(scene.estimator, void()) {
  add_state(hash, scene.estimator, any);
  hash.add(scene.gate.contact());
}
template <class Baseline>
auto add_state(Hash& hash, const Baseline& b, const void*) -> decltype(b.level(), void()) {
  hash.add(b.level());
  hash.add(b.noise());
}
template <class Gate>
auto add_state(Hash& hash, const Gate& gate, const void*) -> decltype(gate.contact(), gate.age(), void()) {
  hash.add(gate.contact());
}
template <class Other>
void add_state(Hash&, const Other&, ...) {}

template <class Scene>
auto put_touch(const char* name, const Scene& scene, const void*) -> decltype(scene.touch(), void()) {
  const auto touch = scene.touch();
  put(name);
  put(" touch");
  const std::uint32_t counts[] = {static_cast<std::uint32_t>(touch.start), touch.samples, touch.alarms, touch.saturated,
                                  touch.refused};
  for (const std::uint32_t count : counts) {
    put(" ");
    put_number(count);
  }
  const auto& f = touch.misfits;
  for (const float number : {touch.ratio, touch.covariance, touch.standard_error, touch.first_ratio, touch.shift,
                             f.offset, f.drift, f.lag, f.curve, f.open, f.open_drift, f.offset_ratio, f.offset_error}) {
    put(" ");
    put_hex(bits(number));
  }
  put("\n");
}

template <class Other>
void put_touch(const char*, const Other&, ...) {}

template <class Subject>
void print(const char* name) {
  typename Subject::State state;
  Readings readings;
  Hash hash;
  for (int i = 0; i < Readings::size; ++i) {
    const Reading reading = readings.next();
    if (!subjects::accepts<Subject>(reading)) {
      continue;
    }
    const auto feed = subjects::Entry<Subject>::feed;
    if constexpr (std::is_void_v<decltype(Subject::with(feed, state, reading))>) {
      Subject::with(feed, state, reading);
    } else {
      const auto result = Subject::with(feed, state, reading);
      hash.add(result);
      if (std::is_same_v<decltype(result), const bool> && result) {
        put_touch(name, state, nullptr);
      }
    }
    add_state(hash, state, nullptr);
  }
  put(name);
  put(" ");
  put_hex(static_cast<std::uint32_t>(hash.value >> 32));
  put_hex(static_cast<std::uint32_t>(hash.value));
  put("\n");
}

}  // namespace

void print_results() {
  subjects::for_each([](const char* name, auto subject) { print<decltype(subject)>(name); });
}

#if __STDC_HOSTED__  // the results on this machine

#include <cstdio>

void put(const char* text) { std::fputs(text, stdout); }

int main() { print_results(); }

#endif
