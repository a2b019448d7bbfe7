// SPDX-License-Identifier: MIT
// A simulated board: the registers of the AD7746, a hand that presses twice, a bus that fails once, which gives a NaN, an
// excitation that fails once. Prints the reports, and at the end the CAPDACs.

#include <cstdio>
#include <cstring>

#include "../readings.hpp"
#include "hal.hpp"

namespace {

struct {
  std::uint32_t now = 4294000000u;  // wraps soon
  std::uint8_t registers[0x13] = {};
  bool converting = false, answers = true;
  int conversions = 0, capdac[2] = {};
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
    board.reading = board.hand.next();
  }
  board.capdac[second] = board.registers[0x0B] & 0x7F;
  const float value = picofarad(second);
  board.answers = value == value;
  const float in_range = value < -4.096f ? -4.096f : value > 4.095f ? 4.095f : value;
  const auto code = static_cast<std::uint32_t>(board.answers ? 8388608.0f + in_range * 2048000.0f : 0.0f);
  const std::uint8_t ready = board.conversions == 60 ? 0x0E : 0x06;
  const std::uint8_t bytes[] = {ready, static_cast<std::uint8_t>(code >> 16), static_cast<std::uint8_t>(code >> 8),
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

void excitation_failed() { std::printf("EXCERR: the pin EXCB is shorted or has too large a load\n"); }

}  // namespace hal

int main() {
  measure();
  std::printf("CAPDAC %d, %d\n", board.capdac[0], board.capdac[1]);
}
