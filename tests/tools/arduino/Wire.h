// SPDX-License-Identifier: MIT
#pragma once

// A board for the sketch palpate_instrument: what it uses of an Arduino core and of its library Wire, with the simulated
// AD7746 of chip.hpp, whose gauges are pressed twice. The excitation fails once in the first touch, and the chip is silent
// for a moment after it. Exit code 1: the chip was used against its data sheet.

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "chip.hpp"

void setup();
void loop();

inline Chip chip(nullptr);
inline std::uint64_t now_us = 0;

inline void pass(std::uint64_t us) {
  now_us += us;
  if (now_us >= 17000000) {
    std::fflush(stdout);
    std::_Exit(chip.faults != 0);
  }
}
inline double pass_byte() {
  pass(90);
  return 1e-6 * static_cast<double>(now_us);
}
inline std::uint32_t micros() {
  pass(4);
  return static_cast<std::uint32_t>(now_us + 4285000000u);  // wraps in the second touch
}
inline void delay(unsigned long ms) { pass(1000 * ms); }
inline void yield() { pass(1); }

inline struct SerialPort {
  void begin(unsigned long) {}
  void print(const char* text) { std::fputs(text, stdout); }
  void print(unsigned long value) { std::printf("%lu", value); }
  void print(double value, int digits) { std::printf("%.*f", digits, value); }
  void println(const char* text) { std::puts(text); }
  void println(unsigned long value) { std::printf("%lu\n", value); }
} Serial;

/// The bus, with the chip on it.
inline struct TwoWire {
  void begin() {}
  void setClock(std::uint32_t) {}
  void beginTransmission(std::uint8_t address) {
    address_ = address;
    count_ = 0;
  }
  std::size_t write(std::uint8_t byte) { return write(&byte, 1); }
  std::size_t write(const std::uint8_t* bytes, std::size_t count) {
    std::copy_n(bytes, count, sent_ + count_);
    count_ += count;
    return count;
  }
  std::uint8_t endTransmission(bool = true) {
    if (!answers(address_)) {
      return 2;
    }
    std::for_each_n(sent_, count_, [](std::uint8_t byte) { chip.write(byte, pass_byte()); });
    return 0;
  }
  std::uint8_t requestFrom(std::uint8_t address, std::uint8_t count) { return answers(address) ? count : 0; }
  int read() { return chip.read(pass_byte()); }

 private:
  static bool answers(std::uint8_t address) {
    const double s = pass_byte();
    return address == 0x48 && chip.select(s);
  }
  std::uint8_t sent_[8] = {};
  std::size_t count_ = 0;
  std::uint8_t address_ = 0;
} Wire;

int main() {
  chip.overloaded = {5.0, 5.03};
  chip.absent = {8.5, 8.7};
  for (setup();;) {
    loop();
  }
}
