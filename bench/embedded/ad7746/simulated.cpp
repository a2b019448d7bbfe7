// SPDX-License-Identifier: MIT
// A simulated board: the registers of the AD7746, a hand that presses twice, a bus that fails once, which gives a NaN.
// Prints the reports.

#include <cstdio>
#include <cstring>

#include "../readings.hpp"
#include "hal.hpp"

namespace {

struct {
  std::uint32_t now = 4294000000u;  // wraps soon
  std::uint8_t registers[0x13] = {};
  bool converting = false, answers = true;
  int conversions = 0;
  Readings hand;
  Reading reading = {};
} board;

void convert() {
  const bool second = (board.registers[0x07] & 0x40) != 0;
  if (!second) {
    board.reading = board.hand.next();
  }
  const float value = second ? board.reading.soft : board.reading.hard;
  board.answers = value == value;
  const auto code = static_cast<std::uint32_t>(board.answers ? 8388608.0f + value * 2048000.0f : 0.0f);
  const std::uint8_t bytes[] = {0x06, static_cast<std::uint8_t>(code >> 16), static_cast<std::uint8_t>(code >> 8),
                                static_cast<std::uint8_t>(code)};
  std::memcpy(board.registers, bytes, sizeof bytes);
  ++board.conversions;
}

}  // namespace

namespace hal {

std::uint32_t now_us() { return board.now; }

void read(std::uint8_t first, std::uint8_t* bytes, std::size_t count) {
  std::memcpy(bytes, board.registers + first, count);
  read_done(board.answers);
}

void write(std::uint8_t first, const std::uint8_t* bytes, std::size_t count) {
  std::memcpy(board.registers + first, bytes, count);
  board.converting = (board.registers[0x0A] & 0x07) == 2;
  write_done(true);
}

bool wait() {
  if (board.converting && board.conversions < 2 * Readings::size) {
    board.now += 13000;
    board.converting = false;
    convert();
    conversion_ready();
    return true;
  }
  return false;
}

void report(const palpate::Touch<float>& touch, std::size_t dropped) {
  std::printf("ratio %.2f +- %.4f, %u samples, %u saturated, %u refused, %zu dropped\n",
              static_cast<double>(touch.ratio), static_cast<double>(touch.standard_error), touch.samples,
              touch.saturated, touch.refused, dropped);
}

}  // namespace hal

int main() { measure(); }
