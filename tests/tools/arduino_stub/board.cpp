// SPDX-License-Identifier: MIT
// A board with a simulated AD7746 for the sketch palpate_instrument: the hand of bench/embedded presses twice, the chip is
// silent once. Ends when the hand has ended.

#include <Wire.h>
#include <palpate.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>

#include "../../../bench/embedded/readings.hpp"

namespace {

constexpr std::uint32_t conversion_us = 10900, byte_us = 90;
constexpr int silent = 500;  // the conversion after which the chip does not answer for a moment

struct {
  std::uint32_t now = 4294000000u;  // wraps soon
  std::uint8_t registers[0x13] = {};
  bool converting = false;
  std::uint32_t ready_us = 0, answers_us = 4294000000u;
  int conversions = 0, pairs = 0;
  Readings hand;
  Reading reading = {};
} board;

// The gauges are at EXCB, and have more capacitance than the converter's range.
float picofarad(bool second) {
  const float gauge = second ? board.reading.soft + 4.69f : board.reading.hard + 6.92f;
  const int steps = board.registers[0x0B] & 0x80 ? board.registers[0x0B] & 0x7F : 0;
  return ((board.registers[0x09] & 0x30) == 0x20 ? gauge : 0.0f) - 0.171f * static_cast<float>(steps);
}

void convert() {
  const bool second = (board.registers[0x07] & 0x40) != 0;
  if (!second) {
    if (++board.pairs > Readings::size) {
      std::exit(0);
    }
    board.reading = board.hand.next();
  }
  const float value = picofarad(second), any = value == value ? value : 0.0f;
  const auto code = static_cast<std::uint32_t>(8388608.0f + std::clamp(any, -4.096f, 4.095f) * 2048000.0f);
  for (int i = 0; i < 3; ++i) {
    board.registers[1 + i] = static_cast<std::uint8_t>(code >> (16 - 8 * i));
  }
}

/// Passes time, in which a conversion may end.
void pass(std::uint32_t us) {
  board.now += us;
  if (board.converting && static_cast<std::int32_t>(board.now - board.ready_us) >= 0) {
    board.converting = false;
    board.registers[0] = 0x06;
    convert();
    if (++board.conversions == silent) {
      board.answers_us = board.now + 250000;
    }
  }
}

bool answers(std::uint8_t address) {
  return address == 0x48 && static_cast<std::int32_t>(board.now - board.answers_us) >= 0;
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
  return board.now;
}
void delay(unsigned long ms) { pass(static_cast<std::uint32_t>(1000 * ms)); }
void yield() { pass(1); }

void TwoWire::beginTransmission(std::uint8_t) { count_ = 0; }
std::size_t TwoWire::write(std::uint8_t byte) { return write(&byte, 1); }
std::size_t TwoWire::write(const std::uint8_t* bytes, std::size_t count) {
  for (std::size_t i = 0; i < count && count_ < sizeof sent_; ++i) {
    sent_[count_++] = bytes[i];
  }
  return count;
}
std::uint8_t TwoWire::endTransmission(bool) {
  pass(static_cast<std::uint32_t>(count_ + 1) * byte_us);
  if (!answers(0x48) || count_ == 0) {
    return 2;
  }
  pointer_ = sent_[0];
  for (std::size_t i = 1; i < count_; ++i, ++pointer_) {
    board.registers[pointer_] = sent_[i];
    if (pointer_ == 0x0A && (sent_[i] & 0x07) == 2) {
      board.converting = true;
      board.registers[0] = 0x07;
      board.ready_us = board.now + conversion_us;
    }
  }
  return 0;
}
std::uint8_t TwoWire::requestFrom(std::uint8_t address, std::uint8_t count) {
  pass((count + 1u) * byte_us);
  return answers(address) ? count : 0;
}
int TwoWire::read() { return board.registers[pointer_++]; }

int main() {
  setup();
  for (;;) {
    loop();
  }
}
