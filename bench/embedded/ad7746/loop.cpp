// SPDX-License-Identifier: MIT
// A complete instrument: the AD7746 converts the two gauges one after the other, interrupts write the codes to a ring,
// the main loop estimates. The interrupts and the loop share only the ring. Registers: AD7746 data sheet, rev. 0. Not
// tried on hardware.

#include <limits>
#include <palpate/ring.hpp>

#include "hal.hpp"

namespace {

constexpr std::uint8_t status = 0x00, cap_setup = 0x07;
constexpr std::uint8_t not_ready = 0x01;                              // RDYCAP
constexpr std::uint8_t cap_enable = 0x80, second_input = 0x40;        // CAPEN, CIN2
constexpr std::uint8_t excitation = 0x0B;                             // EXCA, 3/8 of the supply
constexpr std::uint8_t single_conversion = 0x02, no_temperature = 0;  // CAPF = 0: 11 ms
constexpr std::uint32_t half_conversion_us = 5500;

constexpr std::int32_t zero_code = 0x800000, no_code = -1;
constexpr float full_scale = 4.096f, saturated = full_scale * (1 - 500.0f / 8388608);

/// Both channels, hard first.
struct Codes {
  std::uint32_t time[2];
  std::int32_t code[2];
};
palpate::Ring<Codes, 16> ring;  // 0.4 s: the longest time for a report

/// The state of the interrupts.
struct {
  Codes codes;
  int channel;
  std::uint8_t received[4];
  std::uint8_t setup[4];
} converter;

void start_conversion(int channel) {
  converter.channel = channel;
  converter.setup[0] = static_cast<std::uint8_t>(cap_enable | (channel == 0 ? 0 : second_input));
  converter.setup[1] = no_temperature;
  converter.setup[2] = excitation;
  converter.setup[3] = single_conversion;
  hal::write(cap_setup, converter.setup, sizeof converter.setup);
}

void take(std::int32_t code) {
  converter.codes.code[converter.channel] = code;
  if (converter.channel == 1) {
    ring.try_push(converter.codes);  // counts the dropped ones
  }
  start_conversion(1 - converter.channel);
}

float picofarad(std::int32_t code) {
  return code == no_code ? std::numeric_limits<float>::quiet_NaN()
                         : static_cast<float>(code - zero_code) * (full_scale / 8388608);
}

using Estimator = palpate::embedded::Handover<float>;
constexpr palpate::TrackerSettings<Estimator> settings = [] {
  palpate::TrackerSettings<Estimator> mine;
  mine.full_scale = saturated;
  return mine;
}();
palpate::embedded::HandheldTracker<float, std::uint32_t, Estimator, settings> probe;

}  // namespace

// The effective time of a conversion is its middle.
void conversion_ready() {
  converter.codes.time[converter.channel] = hal::now_us() - half_conversion_us;
  hal::read(status, converter.received, sizeof converter.received);
}

// A failed transfer gives NaN: the tracker counts it and continues.
void read_done(bool acknowledged) {
  const std::uint8_t* const r = converter.received;
  const std::int32_t code = r[1] << 16 | r[2] << 8 | r[3];
  take(acknowledged && !(r[0] & not_ready) ? code : no_code);
}

// If the device does not answer, no conversion will end. After a second without interrupts a board should reset the
// bus.
void write_done(bool acknowledged) {
  if (!acknowledged) {
    converter.codes.time[converter.channel] = hal::now_us();
    take(no_code);
  }
}

void measure() {
  start_conversion(0);
  do {
    Codes codes;
    while (ring.try_pop(codes)) {
      const auto state = probe.feed(codes.time[0], codes.time[1], picofarad(codes.code[0]), picofarad(codes.code[1]));
      if (state.finished) {
        hal::report(probe.touch(), ring.dropped());
      }
    }
  } while (hal::wait());
}
