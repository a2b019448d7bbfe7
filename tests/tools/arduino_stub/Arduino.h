// SPDX-License-Identifier: MIT
#pragma once

// What the sketch palpate_instrument uses of an Arduino core, as the cores declare it.

#include <cstddef>
#include <cstdint>

struct SerialPort {
  void begin(unsigned long) {}
  void print(const char* text);
  void print(unsigned long value);
  void print(double value, int digits);
  void println(const char* text);
  void println(unsigned long value);
};
extern SerialPort Serial;

std::uint32_t micros();
void delay(unsigned long ms);
void yield();
void setup();
void loop();
