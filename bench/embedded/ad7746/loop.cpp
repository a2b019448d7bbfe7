// SPDX-License-Identifier: MIT
// A complete instrument: the AD7746 converts the two gauges one after the other, interrupts write the codes to a ring,
// the main loop estimates. The interrupts and the loop share only the ring. The gauges are between EXCB and CIN1+ (hard),
// CIN2+ (soft); their CAPDACs are set at the beginning, so the probe must not be pressed then. Registers: AD7746 data
// sheet, rev. 0. Not tried on hardware.

#include <limits>
#include <palpate/ring.hpp>

#include "hal.hpp"

namespace {

constexpr std::uint8_t status = 0x00, cap_setup = 0x07, capdac_a = 0x0B;
constexpr std::uint8_t not_ready = 0x01, excitation_error = 0x08;     // RDYCAP, EXCERR
constexpr std::uint8_t cap_enable = 0x80, second_input = 0x40;        // CAPEN, CIN2
constexpr std::uint8_t excitation = 0x20 | 0x03;                      // EXCB only, +-VDD/2
constexpr std::uint8_t single_conversion = 0x02, no_temperature = 0;  // CAPF = 0: 11 ms
constexpr std::uint8_t capdac_enable = 0x80, first_bit = 0x40;        // steps of about 0.164 pF, 0 to 127
constexpr std::uint32_t half_conversion_us = 5500;

constexpr std::int32_t zero_code = 0x800000, no_code = -1, excitation_code = -2;
constexpr float full_scale = 4.096f, saturated = full_scale * (1 - 500.0f / 8388608);

/// Both channels, hard first.
struct Codes {
  std::uint32_t time[2];
  std::int32_t code[2];
};
palpate::Ring<Codes, 16> ring;  // 0.4 s: the longest time for a report

/// The CAPDAC of a channel, which is subtracted from the input: the largest one that leaves a code above the middle.
struct Centre {
  std::uint8_t steps = first_bit, bit = first_bit;  // bit: the one that is tried, 0: found

  void search(std::int32_t code) {
    steps = static_cast<std::uint8_t>(code < zero_code ? steps & ~bit : steps);
    bit /= 2;
    steps |= bit;
  }
};

/// The state of the interrupts.
struct {
  Codes codes = {{0, 0}, {no_code, no_code}};
  Centre centre[2];
  int channel = 0;
  bool setting_up = false;
  std::uint8_t received[4] = {};
  std::uint8_t capdac = 0;
  std::uint8_t setup[4] = {};
} converter;

void start_conversion(int channel) {
  converter.channel = channel;
  converter.setting_up = true;
  converter.capdac = static_cast<std::uint8_t>(capdac_enable | converter.centre[channel].steps);
  hal::write(capdac_a, &converter.capdac, 1);
}

// CONFIG, the last byte, begins the conversion: so the CAPDAC is written before.
void begin() {
  converter.setting_up = false;
  converter.setup[0] = static_cast<std::uint8_t>(cap_enable | (converter.channel == 0 ? 0 : second_input));
  converter.setup[1] = no_temperature;
  converter.setup[2] = excitation;
  converter.setup[3] = single_conversion;
  hal::write(cap_setup, converter.setup, sizeof converter.setup);
}

void take(std::int32_t code) {
  const int channel = converter.channel;
  Centre& centre = converter.centre[channel];
  if (centre.bit && code >= 0) {
    centre.search(code);
    return start_conversion(centre.bit ? channel : 1 - channel);
  }
  converter.codes.code[channel] = code;
  if (channel == 1) {
    ring.try_push(converter.codes);  // counts the dropped ones
  }
  start_conversion(1 - channel);
}

float picofarad(std::int32_t code) {
  return code < 0 ? std::numeric_limits<float>::quiet_NaN()
                  : static_cast<float>(code - zero_code) * (full_scale / 8388608);
}

using Estimator = palpate::embedded::Handover<float>;
constexpr palpate::TrackerSettings<Estimator> settings = [] {
  palpate::TrackerSettings<Estimator> mine;
  mine.full_scale = saturated;
  return mine;
}();
struct Probe : palpate::embedded::LeanHandheld<float> {
  template <class>
  using settings_for = palpate::Constant<settings>;
};
palpate::Tracker<Probe> probe;

}  // namespace

// The effective time of a conversion is its middle.
void conversion_ready() {
  converter.codes.time[converter.channel] = hal::now_us() - half_conversion_us;
  hal::read(status, converter.received, sizeof converter.received);
}

// A failed transfer gives NaN, and so does EXCERR: the tracker counts it and continues.
void read_done(bool acknowledged) {
  const std::uint8_t* const r = converter.received;
  const std::int32_t code = r[1] << 16 | r[2] << 8 | r[3];
  take(!acknowledged || (r[0] & not_ready) ? no_code : (r[0] & excitation_error) ? excitation_code : code);
}

// If the device does not answer, no conversion will end. After a second without interrupts a board should reset the
// bus.
void write_done(bool acknowledged) {
  if (!acknowledged) {
    converter.codes.time[converter.channel] = hal::now_us();
    take(no_code);
  } else if (converter.setting_up) {
    begin();
  }
}

void measure() {
  start_conversion(0);
  do {
    Codes codes;
    while (ring.try_pop(codes)) {
      if (codes.code[0] == excitation_code || codes.code[1] == excitation_code) {
        hal::excitation_failed();
      }
      const auto state = probe.feed(palpate::Microseconds(codes.time[0]), palpate::Microseconds(codes.time[1]),
                                    picofarad(codes.code[0]), picofarad(codes.code[1]));
      if (state.finished) {
        hal::report(probe.touch(), ring.dropped());
      }
    }
  } while (hal::wait());
}
