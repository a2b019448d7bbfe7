// SPDX-License-Identifier: MIT
#pragma once

// What loop.cpp asks of a board, and what the board has to call. Fill it with your vendor's drivers.

#include <cstddef>
#include <cstdint>
#include <palpate/palpate.hpp>

namespace hal {

/// A clock in us that runs on and wraps after 2^32.
std::uint32_t now_us();

/// Start an I2C transfer from or to registers of the device at 0x48 and return; `bytes` stays until it is done. Its
/// interrupt calls read_done or write_done.
void read(std::uint8_t first_register, std::uint8_t* bytes, std::size_t count);
void write(std::uint8_t first_register, const std::uint8_t* bytes, std::size_t count);

/// Sleep until an interrupt (WFI). False: switch off.
bool wait();

/// What the instrument is for.
void report(const palpate::Touch<float>& touch, std::size_t dropped);

}  // namespace hal

/// The pin RDY# of the AD7746 has fallen.
void conversion_ready();
/// A transfer has ended; acknowledged is false where the device did not answer.
void read_done(bool acknowledged);
void write_done(bool acknowledged);

/// Never returns, unless wait() says so.
void measure();
