// SPDX-License-Identifier: MIT
#pragma once

// What the sketch palpate_instrument uses of an Arduino core and of its library Wire, as they declare it.

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

/// The bus, with a simulated AD7746 on it.
class TwoWire {
 public:
  void begin() {}
  void setClock(std::uint32_t) {}
  void beginTransmission(std::uint8_t address);
  std::size_t write(std::uint8_t byte) { return write(&byte, 1); }
  std::size_t write(const std::uint8_t* bytes, std::size_t count);
  std::uint8_t endTransmission(bool stop = true);
  std::uint8_t requestFrom(std::uint8_t address, std::uint8_t count);
  int read();

 private:
  std::uint8_t sent_[8] = {};
  std::size_t count_ = 0;
  std::uint8_t address_ = 0;
};
extern TwoWire Wire;
