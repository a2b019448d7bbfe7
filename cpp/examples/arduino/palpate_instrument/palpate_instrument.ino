// SPDX-License-Identifier: MIT
// Measures the ratio on the board itself: reads a tactile probe with an AD7746 breakout, finds the touches, and prints a
// line for each. For boards with a compiler of C++17, ARM and ESP32; an Uno has none. loop.cpp beside this file is the
// program, and this is what it needs of a board. Wiring: as in palpate_ad7746.ino; RDY# is not connected. Leave the probe
// untouched while it starts. Run on a computer with a simulated AD7746; not tried on hardware.

#include <Wire.h>
#include <palpate.h>

#include "hal.hpp"

namespace {

constexpr std::uint32_t baud = 115200, bus_Hz = 100000;
constexpr std::uint8_t chip_address = 0x48, reset_pointer = 0xBF, config = 0x0A, not_ready = 0x01;
// A conversion takes 11 ms, and may be 5 % shorter; after twice as long there will be none.
constexpr std::uint32_t first_look_us = 9900, too_late_us = 22000, pause_ms = 100;

// A transfer ends before the function that began it, so wait() says later that it has: the program then begins the next.
enum class Ended : std::uint8_t { none, read, write };
Ended ended = Ended::none;
bool acknowledged = false, converting = false;
std::uint32_t begun_us = 0;

bool transferred(std::uint8_t first, std::uint8_t* bytes, std::size_t count) {
  Wire.beginTransmission(chip_address);
  Wire.write(first);
  if (Wire.endTransmission(false) != 0 ||
      Wire.requestFrom(chip_address, static_cast<std::uint8_t>(count)) != static_cast<std::uint8_t>(count)) {
    return false;
  }
  for (std::size_t i = 0; i < count; ++i) {
    bytes[i] = static_cast<std::uint8_t>(Wire.read());
  }
  return true;
}

// False while the converter works. The bus is silent for most of this time, for less noise.
bool conversion_ended() {
  const std::uint32_t waited = micros() - begun_us;
  std::uint8_t status = not_ready;
  return waited >= first_look_us && ((transferred(0, &status, 1) && !(status & not_ready)) || waited > too_late_us);
}

}  // namespace

namespace hal {

std::uint32_t now_us() { return micros(); }

void read(std::uint8_t first, std::uint8_t* bytes, std::size_t count) {
  acknowledged = transferred(first, bytes, count);
  ended = Ended::read;
}

void write(std::uint8_t first, const std::uint8_t* bytes, std::size_t count) {
  Wire.beginTransmission(chip_address);
  Wire.write(first);
  Wire.write(bytes, count);
  acknowledged = Wire.endTransmission() == 0;
  ended = Ended::write;
  begun_us = micros();
  converting = acknowledged && first <= config && config < first + count;
}

bool wait() {
  yield();
  if (ended == Ended::read) {
    ended = Ended::none;
    read_done(acknowledged);
  } else if (ended == Ended::write) {
    ended = Ended::none;
    if (!acknowledged) {
      Serial.println("# AD7746 at 0x48: no answer. Check VDD, GND, SDA, SCL. It is tried again.");
      delay(pause_ms);
    }
    write_done(acknowledged);
  } else if (converting && conversion_ended()) {
    converting = false;
    conversion_ready();
  }
  return true;
}

void report(const palpate::Touch<float>& touch, std::size_t dropped) {
  Serial.print("ratio ");
  Serial.print(touch.ratio, 4);
  Serial.print(" +- ");
  Serial.print(touch.standard_error, 4);  // of the lean tracker: what the noise of the samples leaves open
  Serial.print(", noise only, samples ");
  Serial.print(static_cast<unsigned long>(touch.samples));
  Serial.print(", saturated ");
  Serial.print(static_cast<unsigned long>(touch.saturated));
  Serial.print(", refused ");
  Serial.print(static_cast<unsigned long>(touch.refused));
  Serial.print(", dropped ");
  Serial.println(static_cast<unsigned long>(dropped));
}

void excitation_failed() { Serial.println("# EXCERR: EXCB is shorted or has too large a load"); }

}  // namespace hal

void setup() {
  Serial.begin(baud);
  Wire.begin();
  Wire.setClock(bus_Hz);
  Wire.beginTransmission(chip_address);
  Wire.write(reset_pointer);
  Wire.endTransmission();
  delay(1);
  Serial.println("# palpate " PALPATE_VERSION ": do not touch the probe");
}

void loop() { measure(); }
