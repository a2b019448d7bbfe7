// SPDX-License-Identifier: MIT
// Reads a tactile probe with an AD7746 breakout and prints a line for each pair of readings: `palpate record
// serial:PORT` reads them. Registers: AD7746 data sheet, rev. 0. Run on a simulated ATmega328P with a simulated AD7746;
// not tried on hardware.
//
//   breakout   Uno          other boards
//   VDD        5V           the supply of their pins: 3.3 V where the pins have 3.3 V
//   GND        GND          GND
//   SDA        A4 (SDA)     SDA
//   SCL        A5 (SCL)     SCL
//   CIN1+      hard gauge, one end
//   CIN2+      soft gauge, one end
//   EXCB       both gauges, the other end
// Not connected: CIN1-, CIN2-, EXCA, RDY#, VIN, REFIN. Pull-ups of SDA and SCL, 4.7 to 10 kOhm to VDD, are on most
// breakouts. A screen of the cables goes to GND.
//
// A line for each pair, and lines for people, which begin with #:
//   seq=12,t_hard_us=553988,t_soft_us=567596,hard_raw=8552419,soft_raw=8538243,capdac_hard=40,capdac_soft=27,status=0,
//   t_uncertainty_us=584*5A     (one line)
// t: middle of a conversion, us, wraps after 2^32. raw: code of 24 bits. status: sum of 1 (hard saturated), 2 (soft
// saturated), 4 (EXCERR). t_uncertainty: largest error of the difference of the times. After *: exclusive or of all
// characters before it. A pair that failed leaves a gap in seq. After two failures, and after the letter c from the
// computer, the sketch begins again: it centres both channels, and seq begins at 0. Do not press the probe then.

#include <Wire.h>

namespace {

constexpr uint32_t baud = 115200, bus_Hz = 100000;
constexpr byte chip_address = 0x48, reset_pointer = 0xBF;
enum Register : byte { Status, CapData, CapSetup = 0x07, ExcSetup = 0x09, CapdacA = 0x0B };
constexpr byte excerr = 0x08, rdycap = 0x01;         // STATUS
constexpr byte capen = 0x80, cin2 = 0x40;            // CAP_SETUP
constexpr byte excb = 0x20, half_supply = 0x03;      // EXC_SETUP: the pin, and the level +-VDD/2
constexpr byte excitation = excb | half_supply;      // without bits for EXCA: that pin is not driven
constexpr byte single = 0x02;                        // CONFIG: CAPF 0, one conversion
constexpr byte dac_enable = 0x80, dac_steps = 0x7F;  // CAPDAC: one step is about 0.164 pF
constexpr uint32_t conversion_us = 11000, too_late_us = 2 * conversion_us;
constexpr uint32_t zero = 0x800000, last = 0xFFFFFF, margin = 500;  // a code nearer to an end is saturated

struct Channel {
  explicit Channel(byte setup) : setup(setup) {}

  const byte setup;                          // of CAP_SETUP
  byte capdac = 0;                           // steps, the same for all conversions
  uint32_t asked_us = 0, begun_us = 0;       // of the conversion that runs
  uint32_t middle_us = 0, uncertain_us = 0;  // of the last one
  uint32_t code = 0;
  bool excitation_failed = false;

  bool saturated() const { return code < margin || code > last - margin; }
};

Channel hard(capen), soft(capen | cin2);
bool centred = false, measured = false, failed = false;
uint32_t seq = 0;

bool write_registers(byte first, const byte* bytes, byte count) {
  Wire.beginTransmission(chip_address);
  Wire.write(first);
  Wire.write(bytes, count);
  return Wire.endTransmission() == 0;
}

bool read_registers(byte first, byte* bytes, byte count) {
  Wire.beginTransmission(chip_address);
  Wire.write(first);
  if (Wire.endTransmission(false) != 0 || Wire.requestFrom(chip_address, count) != count) {
    return false;
  }
  for (byte i = 0; i < count; ++i) {
    bytes[i] = Wire.read();
  }
  return true;
}

// CONFIG, which begins the conversion, comes last.
bool begin_conversion(Channel& channel) {
  const byte capdac = dac_enable | channel.capdac, setup[] = {channel.setup, 0, excitation, single};
  if (!write_registers(CapdacA, &capdac, 1)) {
    return false;
  }
  channel.asked_us = micros();
  const bool written = write_registers(CapSetup, setup, sizeof setup);
  channel.begun_us = micros();
  return written;
}

// The bus is silent during the conversion, whose time may be 5 % shorter than the data sheet says.
bool wait_for_end(const Channel& channel) {
  byte status = rdycap;
  uint32_t waited_us = 0;
  while ((status & rdycap) && waited_us <= too_late_us) {
    waited_us = micros() - channel.begun_us;
    if (waited_us > conversion_us / 10 * 9 && !read_registers(Status, &status, 1)) {
      return false;
    }
  }
  return !(status & rdycap);
}

// One transfer for data and settings. If the settings are not as written, the chip had no supply for a moment, or the
// data are of another channel.
bool finish_conversion(Channel& channel) {
  byte chip[CapdacA + 1];
  if (!wait_for_end(channel) || !read_registers(Status, chip, sizeof chip)) {
    return false;
  }
  channel.middle_us = channel.begun_us + conversion_us / 2;
  channel.uncertain_us = channel.begun_us - channel.asked_us;
  channel.code = uint32_t(chip[CapData]) << 16 | uint32_t(chip[CapData + 1]) << 8 | chip[CapData + 2];
  channel.excitation_failed = chip[Status] & excerr;
  return !(chip[Status] & rdycap) && chip[CapSetup] == channel.setup && chip[ExcSetup] == excitation &&
         chip[CapdacA] == (dac_enable | channel.capdac);
}

bool convert(Channel& channel) { return begin_conversion(channel) && finish_conversion(channel); }

// The CAPDAC is subtracted from the input. Search the largest one that leaves a code above the middle.
bool centre(Channel& channel) {
  channel.capdac = 0;
  for (byte bit = (dac_steps + 1) / 2; bit; bit /= 2) {
    channel.capdac |= bit;
    if (!convert(channel)) {
      return false;
    }
    if (channel.code < zero) {
      channel.capdac &= ~bit;
    }
  }
  return convert(channel);
}

void describe(const __FlashStringHelper* name, const Channel& channel) {
  Serial.print(F("# "));
  Serial.print(name);
  Serial.print(F(": CAPDAC "));
  Serial.print(channel.capdac);
  Serial.print(F(", code "));
  Serial.println(channel.code);
  if (channel.excitation_failed) {
    Serial.println(F("# EXCERR: EXCB is shorted or has too large a load"));
  } else if (channel.saturated()) {
    Serial.println(F("# out of range: more than 17 pF, less than 0 pF, or a short"));
  } else if (channel.capdac == 0) {
    Serial.println(F("# less than 0.2 pF: is the gauge connected, its other end to EXCB?"));
  }
}

bool start() {
  Wire.beginTransmission(chip_address);
  Wire.write(reset_pointer);
  Wire.endTransmission();
  delay(1);
  if (!centre(hard) || !centre(soft)) {
    return false;
  }
  Serial.println(F("# AD7746, CAPF 0, excitation EXCB for both inputs, level 3: +-VDD/2"));
  describe(F("hard, CIN1"), hard);
  describe(F("soft, CIN2"), soft);
  seq = 0;
  return true;
}

// Prints, and computes the exclusive or of what is printed.
struct Summed : Print {
  byte sum = 0;
  size_t write(uint8_t character) override {
    sum ^= character;
    return Serial.write(character);
  }
  using Print::write;
  void field(const __FlashStringHelper* name, uint32_t value) {
    print(name);
    print(value);
  }
};

void print_pair(uint32_t number) {
  const byte status =
      hard.saturated() | soft.saturated() << 1 | (hard.excitation_failed || soft.excitation_failed) << 2;
  Summed line;
  line.field(F("seq="), number);
  line.field(F(",t_hard_us="), hard.middle_us);
  line.field(F(",t_soft_us="), soft.middle_us);
  line.field(F(",hard_raw="), hard.code);
  line.field(F(",soft_raw="), soft.code);
  line.field(F(",capdac_hard="), hard.capdac);
  line.field(F(",capdac_soft="), soft.capdac);
  line.field(F(",status="), status);
  line.field(F(",t_uncertainty_us="), max(hard.uncertain_us, soft.uncertain_us));
  Serial.print(line.sum < 0x10 ? F("*0") : F("*"));
  Serial.println(line.sum, HEX);
}

void fail() {
  centred = centred && !failed;
  if (!failed) {
    Serial.println(F("# AD7746 at 0x48: no answer, or not as set. Check VDD, GND, SDA, SCL. It is tried again."));
  }
  failed = true;
  delay(100);
}

}  // namespace

void setup() {
  Serial.begin(baud);
  Serial.println();  // ends what was sent before the reset
  Wire.begin();
  Wire.setClock(bus_Hz);
#ifdef WIRE_HAS_TIMEOUT
  Wire.setWireTimeout(25000, true);  // us: a wire that is held low must not stop the program
#endif
}

void loop() {
  if (Serial.read() == 'c') {
    centred = measured = false;
  }
  if (!centred) {
    centred = start();
  }
  const bool begun = centred && begin_conversion(hard);
  if (measured) {
    print_pair(seq - 1);  // while the converter works
  }
  measured = begun && finish_conversion(hard) && convert(soft);
  seq += centred;
  if (!measured) {
    fail();
  } else if (failed) {
    Serial.println(F("# AD7746 answers again"));
    failed = false;
  }
}
