// SPDX-License-Identifier: MIT
#pragma once

#include <Arduino.h>

/// The bus, with a simulated AD7746 on it.
class TwoWire {
 public:
  void begin() {}
  void setClock(std::uint32_t) {}
  void beginTransmission(std::uint8_t address);
  std::size_t write(std::uint8_t byte);
  std::size_t write(const std::uint8_t* bytes, std::size_t count);
  std::uint8_t endTransmission(bool stop = true);
  std::uint8_t requestFrom(std::uint8_t address, std::uint8_t count);
  int read();

 private:
  std::uint8_t sent_[8] = {};
  std::size_t count_ = 0;
  std::uint8_t pointer_ = 0;
};
extern TwoWire Wire;
