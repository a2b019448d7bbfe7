// SPDX-License-Identifier: MIT
#pragma once

// Functions of the board that loop.cpp calls, and functions that the board must call. Write them with the drivers of
// your vendor.

#include <cstddef>
#include <cstdint>
#include <palpate/palpate.hpp>

namespace hal {

/// A clock in us that never stops and wraps after 2^32.
std::uint32_t now_us();

/// Start an I2C transfer from or to registers of the device at 0x48 and return; `bytes` stays until it is done. Its
/// interrupt calls read_done or write_done.
void read(std::uint8_t first_register, std::uint8_t* bytes, std::size_t count);
void write(std::uint8_t first_register, const std::uint8_t* bytes, std::size_t count);

/// Sleep until an interrupt (WFI). False: the program ends.
bool wait();

/// Report a result.
void report(const palpate::Touch<float>& touch, std::size_t dropped);

/// EXCERR in a pair: the pin EXCB is shorted or has too large a load.
void excitation_failed();

}  // namespace hal

/// To be called when the pin RDY# of the AD7746 falls.
void conversion_ready();
/// To be called at the end of a transfer; acknowledged is false if the device did not answer.
void read_done(bool acknowledged);
void write_done(bool acknowledged);

/// The main loop; returns only if wait() returns false.
void measure();
