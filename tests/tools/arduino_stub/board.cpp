// SPDX-License-Identifier: MIT
// A board for the sketch palpate_instrument, with the simulated AD7746 of ../arduino, whose gauges are pressed twice. The
// excitation fails once in the first touch, and the chip is silent for a moment after it. Exit code 1: the chip was used
// against its data sheet.

#include <Wire.h>

#include <algorithm>
#include <cstdlib>

#include "../arduino/chip.hpp"

namespace {

constexpr std::uint64_t end_us = 17000000, byte_us = 90;

Chip chip(nullptr);
std::uint64_t now_us = 0;

void pass(std::uint64_t us) {
  now_us += us;
  if (now_us >= end_us) {
    std::fflush(stdout);
    std::_Exit(chip.faults != 0);
  }
}

double now_s() { return 1e-6 * static_cast<double>(now_us); }

bool answers(std::uint8_t address) {
  pass(byte_us);
  return address == 0x48 && chip.select(now_s());
}

}  // namespace

SerialPort Serial;
TwoWire Wire;

void SerialPort::print(const char* text) { std::fputs(text, stdout); }
void SerialPort::print(unsigned long value) { std::printf("%lu", value); }
void SerialPort::print(double value, int digits) { std::printf("%.*f", digits, value); }
void SerialPort::println(const char* text) { std::puts(text); }
void SerialPort::println(unsigned long value) { std::printf("%lu\n", value); }

std::uint32_t micros() {
  pass(4);
  return static_cast<std::uint32_t>(now_us + 4285000000u);  // wraps in the second touch
}
void delay(unsigned long ms) { pass(1000 * ms); }
void yield() { pass(1); }

void TwoWire::beginTransmission(std::uint8_t address) {
  address_ = address;
  count_ = 0;
}
std::size_t TwoWire::write(const std::uint8_t* bytes, std::size_t count) {
  std::copy_n(bytes, count, sent_ + count_);
  count_ += count;
  return count;
}
std::uint8_t TwoWire::endTransmission(bool) {
  if (!answers(address_)) {
    return 2;
  }
  for (std::size_t i = 0; i < count_; ++i) {
    pass(byte_us);
    chip.write(sent_[i], now_s());
  }
  return 0;
}
std::uint8_t TwoWire::requestFrom(std::uint8_t address, std::uint8_t count) { return answers(address) ? count : 0; }
int TwoWire::read() {
  pass(byte_us);
  return chip.read(now_s());
}

int main() {
  chip.overloaded = {5.0, 5.03};
  chip.absent = {8.5, 8.7};
  for (setup();;) {
    loop();
  }
}
